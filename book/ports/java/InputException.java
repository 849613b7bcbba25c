import java.io.IOException;
import java.nio.charset.CharacterCodingException;
import java.nio.file.AccessDeniedException;
import java.nio.file.NoSuchFileException;
import java.nio.file.Path;

/** Input that cannot be used; the message names the file and, where there is one, the line. */
final class InputException extends Exception {

    private static final long serialVersionUID = 1L;

    InputException(Path file, String problem) {
        super(file + ": " + problem);
    }

    /** A problem in a line, counted from 1. */
    InputException(Path file, int line, String problem) {
        super(file + ":" + line + ": " + problem);
    }

    InputException(Path file, IOException cause) {
        this(file, "cannot be read: " + reason(cause));
    }

    private static String reason(IOException cause) {
        if (cause instanceof NoSuchFileException) {
            return "no such file";
        } else if (cause instanceof AccessDeniedException) {
            return "permission denied";
        } else if (cause instanceof CharacterCodingException) {
            return "not UTF-8 text";
        }
        return String.valueOf(cause.getMessage());
    }
}
