import java.io.IOException;
import java.nio.file.Files;
import java.nio.file.Path;
import java.util.LinkedHashMap;
import java.util.List;
import java.util.Map;
import java.util.Set;
import java.util.regex.Matcher;
import java.util.regex.Pattern;
import java.util.stream.Collectors;

/** As much JSON as the lab needs: reads a flat object of numbers, writes an answer. */
final class Json {

    private static final Pattern BLANK = Pattern.compile("[ \t\r\n]*");
    private static final Pattern KEY = Pattern.compile("\"([^\"\\\\\\x00-\\x1f]*)\"");
    private static final Pattern NUMBER =
            Pattern.compile("-?(?:0|[1-9][0-9]*)(?:\\.[0-9]+)?(?:[eE][+-]?[0-9]+)?");
    private static final Pattern WORD = Pattern.compile("[^\\s,:{}\\[\\]]+|.", Pattern.DOTALL);

    private final Path file;
    private final String text;
    private int position;

    private Json(Path file, String text) {
        this.file = file;
        this.text = text;
    }

    /**
     * Reads an object of numbers and nulls.
     *
     * @param keys the keys that may occur, each at most once
     * @return the numbers by key; null where the file says {@code null}
     */
    static Map<String, Double> read(Path file, Set<String> keys) throws InputException {
        try {
            return new Json(file, Files.readString(file)).object(keys);
        } catch (IOException cause) {
            throw new InputException(file, cause);
        }
    }

    private Map<String, Double> object(Set<String> keys) throws InputException {
        Map<String, Double> members = new LinkedHashMap<>();
        expect("{");
        if (!accept("}")) {
            do {
                String key = key(keys);
                if (members.containsKey(key)) {
                    throw problem("the key `" + key + "` occurs twice");
                }
                expect(":");
                members.put(key, number());
            } while (accept(","));
            expect("}");
        }
        skipBlanks();
        if (position < text.length()) {
            throw unexpected("the end");
        }
        return members;
    }

    private String key(Set<String> keys) throws InputException {
        String quoted = next(KEY, "a key in quotes");
        String key = quoted.substring(1, quoted.length() - 1);
        if (!keys.contains(key)) {
            throw problem("unknown key " + Decimal.quote(key)
                    + "; known are " + String.join(", ", keys));
        }
        return key;
    }

    private Double number() throws InputException {
        if (accept("null")) {
            return null;
        }
        try {
            return Decimal.parse(next(NUMBER, "a number or null"));
        } catch (NumberFormatException tooLarge) {
            throw problem(tooLarge.getMessage());
        }
    }

    private boolean accept(String symbol) {
        skipBlanks();
        boolean found = text.startsWith(symbol, position);
        position += found ? symbol.length() : 0;
        return found;
    }

    private void expect(String symbol) throws InputException {
        if (!accept(symbol)) {
            throw unexpected("`" + symbol + "`");
        }
    }

    private String next(Pattern token, String expected) throws InputException {
        skipBlanks();
        Matcher matcher = token.matcher(text).region(position, text.length());
        if (!matcher.lookingAt()) {
            throw unexpected(expected);
        }
        position = matcher.end();
        return matcher.group();
    }

    private void skipBlanks() {
        Matcher blanks = BLANK.matcher(text).region(position, text.length());
        position = blanks.lookingAt() ? blanks.end() : position;
    }

    private InputException unexpected(String expected) {
        Matcher word = WORD.matcher(text).region(position, text.length());
        String received = word.lookingAt() ? Decimal.quote(word.group()) : "the end of the file";
        return problem("expected " + expected + ", got " + received);
    }

    private InputException problem(String message) {
        long line = 1 + text.substring(0, position).chars().filter(c -> c == '\n').count();
        return new InputException(file, (int) line, message);
    }

    /**
     * Writes a value on one line: a map as an object in its order, a list, a string or a number.
     *
     * <p>A number keeps the digits it takes to read the same double again; NaN and infinity, which
     * JSON does not know, become {@code null}.
     */
    static String write(Object value) {
        if (value instanceof Map<?, ?> map) {
            return map.entrySet().stream()
                    .map(member -> write(member.getKey()) + ": " + write(member.getValue()))
                    .collect(Collectors.joining(", ", "{", "}"));
        } else if (value instanceof List<?> list) {
            return list.stream().map(Json::write).collect(Collectors.joining(", ", "[", "]"));
        } else if (value instanceof String string) {
            return quote(string);
        } else if (value instanceof Number number && Double.isFinite(number.doubleValue())) {
            return number.toString();
        }
        return "null";
    }

    private static String quote(String string) {
        return string.chars()
                .mapToObj(c -> switch (c) {
                    case '"' -> "\\\"";
                    case '\\' -> "\\\\";
                    default -> c < ' ' ? String.format("\\u%04x", c) : Character.toString(c);
                })
                .collect(Collectors.joining("", "\"", "\""));
    }
}
