import java.util.List;
import java.util.Locale;
import java.util.function.Function;

/**
 * The closed form for fixed pairs (section 3 of the lesson): the R and t that minimise
 *
 * <pre>J(R, t) = Σ wᵢ ‖R pᵢ + t − qᵢ‖²      (2.1)</pre>
 */
final class Alignment {

    /** Below this share of the data's own scale, a length counts as zero. */
    private static final double RELATIVE_RESOLUTION = 1e-10;

    private static final double ROUNDING = 64.0 * Math.ulp(1.0);

    private Alignment() {}

    /**
     * The rigid motion that best maps the sources of {@code allPairs} onto their targets.
     *
     * @return {@code targetFromSource}, the unique minimiser of (2.1)
     * @throws DegenerateAlignmentException where more than one rotation fits equally well
     */
    static Transform align(List<Pair> allPairs) throws DegenerateAlignmentException {
        List<Pair> pairs = withWeight(allPairs);
        double total = pairs.stream().mapToDouble(Pair::weight).sum();
        Point sourceMean = centroid(pairs, Pair::source, total);
        Point targetMean = centroid(pairs, Pair::target, total);
        double sourceSpread = spread("source", pairs, Pair::source, sourceMean, total);
        double targetSpread = spread("target", pairs, Pair::target, targetMean, total);

        double a = 0.0;
        double b = 0.0;
        for (Pair pair : pairs) {
            Point x = pair.source().minus(sourceMean); // (2.2)
            Point y = pair.target().minus(targetMean);
            a += pair.weight() * x.dot(y); // (2.5)
            b += pair.weight() * x.cross(y); // (2.6)
        }
        requireRotation(Math.hypot(a, b), total * sourceSpread * targetSpread);

        double theta = Math.atan2(b, a); // (2.7)
        Point turned = Transform.of(0.0, 0.0, theta).apply(sourceMean);
        Point t = targetMean.minus(turned); // (2.3)
        return Transform.of(t.x(), t.y(), theta);
    }

    /** The pairs that say something: one of weight 0 does not, wherever it lies. */
    private static List<Pair> withWeight(List<Pair> pairs) throws DegenerateAlignmentException {
        List<Pair> kept = pairs.stream().filter(pair -> pair.weight() > 0.0).toList();
        if (kept.isEmpty()) {
            throw degenerate("all %d weights are zero, so no pair says anything", pairs.size());
        }
        return kept;
    }

    private static Point centroid(List<Pair> pairs, Function<Pair, Point> side, double total) {
        double x = 0.0;
        double y = 0.0;
        for (Pair pair : pairs) {
            x += pair.weight() * side.apply(pair).x();
            y += pair.weight() * side.apply(pair).y();
        }
        return new Point(x / total, y / total);
    }

    /**
     * The weighted root mean square distance of one side from its centroid, in metres.
     *
     * <p>It must stand out from rounding, which is judged by the largest coordinate. The test is
     * written so that NaN, from sums beyond the range of a double, fails it too.
     */
    private static double spread(
            String name, List<Pair> pairs, Function<Pair, Point> side, Point mean, double total)
            throws DegenerateAlignmentException {
        double squares = 0.0;
        double largest = 0.0;
        double largestFromMean = 0.0;
        for (Pair pair : pairs) {
            Point point = side.apply(pair);
            Point fromMean = point.minus(mean);
            squares += pair.weight() * fromMean.dot(fromMean);
            largest = Math.max(largest, point.largestCoordinate());
            largestFromMean = Math.max(largestFromMean, fromMean.largestCoordinate());
        }
        double spread = Math.sqrt(squares / total);
        if (!(spread > Math.max(ROUNDING * largest, RELATIVE_RESOLUTION * largestFromMean))) {
            throw degenerate(
                    "the weighted %s points coincide (spread %.3g m over %d pairs), so the rotation"
                            + " is undetermined; at least 2 distinct pairs with weight are needed",
                    name, spread, pairs.size());
        }
        return spread;
    }

    /** Refuses pairs with a = b = 0 within their scale in m²: the cosine to maximise is flat. */
    private static void requireRotation(double strength, double scale)
            throws DegenerateAlignmentException {
        if (!(strength > RELATIVE_RESOLUTION * scale)) {
            throw degenerate(
                    "every rotation fits these pairs equally well (a = b = 0 within %.0e of their"
                            + " scale %.3g m²); is the target a mirror image of the source?",
                    RELATIVE_RESOLUTION, scale);
        }
    }

    private static DegenerateAlignmentException degenerate(String format, Object... values) {
        return new DegenerateAlignmentException(String.format(Locale.ROOT, format, values));
    }
}
