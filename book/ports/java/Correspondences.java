import java.util.ArrayList;
import java.util.Arrays;
import java.util.List;

/**
 * The pairs that one association believes, and what it cost (section 4 of the lesson).
 *
 * <p>The stages are match, reject by gate (A) and overlap (B), and weigh (C). Residuals, gate and
 * delta are distances in metres, never squares.
 *
 * @param kept the pairs that passed gate and overlap, weighted, both points in the target's frame
 * @param sourceCount N, the number of source points, kept or not
 * @param cost the truncated Huber cost J in m², a mean over all N source points
 */
record Correspondences(List<Pair> kept, int sourceCount, double cost) {

    /** The fewest pairs that a step is computed from, as in the lesson. */
    static final int MIN_PAIRS = 3;

    /** Matches, rejects and weighs at the pose {@code targetFromSource}. */
    static Correspondences associate(
            List<Point> source,
            NearestNeighbors target,
            Transform targetFromSource,
            IcpParameters parameters) {
        int count = source.size();
        Point[] moved = new Point[count];
        Point[] nearest = new Point[count];
        double[] distances = new double[count];
        for (int i = 0; i < count; i++) {
            moved[i] = targetFromSource.apply(source.get(i));
            nearest[i] = target.nearest(moved[i]);
            distances[i] = moved[i].minus(nearest[i]).norm();
        }

        double gate = parameters.maxCorrespondenceDistance();
        double delta = parameters.huberDelta();
        boolean[] withinOverlap = overlap(distances, parameters.overlapRatio());
        List<Pair> kept = new ArrayList<>(count);
        double loss = 0.0;
        for (int i = 0; i < count; i++) {
            if (!withinOverlap[i]) {
                continue;
            }
            if (distances[i] <= gate) { // (A)
                kept.add(new Pair(moved[i], nearest[i], huberWeight(distances[i], delta)));
            }
            loss += huberLoss(Math.min(distances[i], gate), delta); // (4.1)
        }
        return new Correspondences(kept, count, loss / count);
    }

    /**
     * (B) The trimming step: which pairs are among the ⌊ρN⌋ closest, but at least 3.
     *
     * @param distances residuals of <em>all</em> N source points in metres, gated or not, so that
     *     ρ keeps its meaning: the share of the source that has a partner
     * @param overlapRatio ρ in (0, 1]
     * @return true for the pairs kept; of equal residuals the first ones
     */
    static boolean[] overlap(double[] distances, double overlapRatio) {
        int count = distances.length;
        int share = Math.min(count, Math.max(MIN_PAIRS, (int) (overlapRatio * count)));
        double[] sorted = distances.clone();
        Arrays.sort(sorted);
        double largest = sorted[share - 1];
        int equalToLargest = share; // how many of those with the largest residual have room
        for (int i = 0; i < share && sorted[i] < largest; i++) {
            equalToLargest--;
        }

        boolean[] within = new boolean[count];
        for (int i = 0; i < count; i++) {
            within[i] = distances[i] < largest
                    || (distances[i] == largest && equalToLargest-- > 0);
        }
        return within;
    }

    /** (C) Huber's weight of a residual [m]: 1 up to δ [m], δ/r beyond. */
    static double huberWeight(double residual, double delta) {
        return residual <= delta ? 1.0 : delta / residual;
    }

    /** Huber's loss [m²] whose weight that is: r² up to δ, 2δr − δ² beyond. */
    static double huberLoss(double residual, double delta) {
        double capped = Math.min(residual, delta);
        return capped * (2.0 * residual - capped);
    }

    int inlierCount() {
        return kept.size();
    }

    /** Kept pairs over source points, in [0, 1]. */
    double fitness() {
        return (double) inlierCount() / sourceCount;
    }

    /** Root mean square distance of the kept pairs in metres; NaN, not 0, where none was kept. */
    double inlierRmse() {
        double squares = 0.0;
        for (Pair pair : kept) {
            squares += pair.distance() * pair.distance();
        }
        return Math.sqrt(squares / inlierCount());
    }
}
