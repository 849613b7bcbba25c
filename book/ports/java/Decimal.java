import java.util.regex.Pattern;

/**
 * Finite decimal numbers and nothing else.
 *
 * <p>{@code Double.parseDouble} alone would also take NaN, Infinity, hexadecimal digits and a
 * trailing {@code d} or {@code f}, and would turn 1e999 into infinity.
 */
final class Decimal {

    private static final Pattern DECIMAL =
            Pattern.compile("[+-]?(?:[0-9]+\\.?[0-9]*|\\.[0-9]+)(?:[eE][+-]?[0-9]+)?");
    private static final Pattern BLANKS_AROUND = Pattern.compile("^[ \t]+|[ \t]+$");
    private static final int SHOWN = 40; // characters of a bad number that a message repeats

    private Decimal() {}

    /**
     * Reads a number with or without blanks and tabs around it.
     *
     * @throws NumberFormatException for anything that is no finite decimal number, showing it
     */
    static double parse(String text) {
        String digits = BLANKS_AROUND.matcher(text).replaceAll("");
        double value = DECIMAL.matcher(digits).matches() ? Double.parseDouble(digits) : Double.NaN;
        if (!Double.isFinite(value)) {
            throw new NumberFormatException("expected a finite number, got " + quote(digits));
        }
        return value;
    }

    static String quote(String text) {
        return "`" + (text.length() <= SHOWN ? text : text.substring(0, SHOWN) + "...") + "`";
    }
}
