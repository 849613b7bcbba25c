/**
 * Pairs that leave the rotation undetermined: no single rigid motion fits them best.
 *
 * <p>Checked, because it is the data's doing and not a mistake of the program: the compiler sees to
 * it that whoever aligns has an answer to it.
 */
final class DegenerateAlignmentException extends Exception {

    private static final long serialVersionUID = 1L;

    DegenerateAlignmentException(String message) {
        super(message);
    }
}
