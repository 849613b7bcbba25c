/**
 * A source point and the target point that it is taken to be; both in metres.
 *
 * @param source p, of the newer scan
 * @param target q, of the older scan
 * @param weight w, finite and not negative; only the ratios of weights matter
 */
record Pair(Point source, Point target, double weight) {

    Pair {
        if (!(weight >= 0.0 && Double.isFinite(weight))) {
            throw new IllegalArgumentException("a weight must be finite and at least 0, got " + weight);
        }
    }

    /** How far the two are apart, in metres. */
    double distance() {
        return source.minus(target).norm();
    }
}
