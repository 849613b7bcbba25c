import java.io.IOException;
import java.nio.file.Files;
import java.nio.file.Path;
import java.util.ArrayList;
import java.util.Arrays;
import java.util.List;
import java.util.function.Function;
import java.util.stream.Collectors;

/** Comma-separated numbers without a header: points, pairs and increments. */
final class Csv {

    private Csv() {}

    /** A scan: one {@code x,y} a line, in metres. */
    static List<Point> points(Path file) throws InputException {
        return requireRows(file, rows(file, row -> new Point(row[0], row[1]), 2));
    }

    /** Pairs: {@code px,py,qx,qy} or {@code px,py,qx,qy,w} a line, in metres; w is 1 by default. */
    static List<Pair> pairs(Path file) throws InputException {
        return requireRows(file, rows(file, Csv::pair, 4, 5));
    }

    private static Pair pair(double[] row) {
        double weight = row.length == 5 ? row[4] : 1.0;
        return new Pair(new Point(row[0], row[1]), new Point(row[2], row[3]), weight);
    }

    /** Increments: one {@code dx,dy,dtheta} a line, in metres and radians; may be none. */
    static List<Pose> increments(Path file) throws InputException {
        return rows(file, row -> new Pose(row[0], row[1], row[2]), 3);
    }

    private static <T> List<T> rows(Path file, Function<double[], T> record, int... widths)
            throws InputException {
        List<T> records = new ArrayList<>();
        int number = 0;
        for (String line : lines(file)) {
            number++;
            try {
                records.add(record.apply(numbers(line, widths)));
            } catch (IllegalArgumentException problem) {
                throw new InputException(file, number, problem.getMessage());
            }
        }
        return records;
    }

    private static double[] numbers(String line, int... widths) {
        String[] fields = line.split(",", -1); // -1: an empty field at the end counts too
        if (Arrays.stream(widths).noneMatch(width -> width == fields.length)) {
            String expected = Arrays.stream(widths)
                    .mapToObj(String::valueOf)
                    .collect(Collectors.joining(" or "));
            throw new IllegalArgumentException("expected " + expected
                    + " numbers, got " + fields.length + " in " + Decimal.quote(line));
        }
        return Arrays.stream(fields).mapToDouble(Decimal::parse).toArray();
    }

    private static <T> List<T> requireRows(Path file, List<T> rows) throws InputException {
        if (rows.isEmpty()) {
            throw new InputException(file, "is empty; at least one row is needed");
        }
        return rows;
    }

    /** The lines of a UTF-8 text file; a lone carriage return ends none. */
    static List<String> lines(Path file) throws InputException {
        try {
            String[] lines = Files.readString(file).split("\r?\n", -1);
            boolean ended = lines[lines.length - 1].isEmpty();
            return Arrays.asList(lines).subList(0, lines.length - (ended ? 1 : 0));
        } catch (IOException cause) {
            throw new InputException(file, cause);
        }
    }
}
