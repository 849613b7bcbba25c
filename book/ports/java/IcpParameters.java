/**
 * Everything that the ICP loop can be told; checked when it is made.
 *
 * <p>A gate or delta of {@code Double.POSITIVE_INFINITY} is off. Messages use the names of the
 * parameter file.
 *
 * @param maxCorrespondenceDistance the gate d_max &gt; 0 in metres
 * @param overlapRatio ρ in (0, 1], the share of the source points, closest first, that is kept
 * @param huberDelta δ &gt; 0 in metres; residuals beyond it weigh δ/r
 * @param maxIterations the budget, at least 1
 * @param translationTolerance ε_t ≥ 0 in metres; converged when a step stays below both
 * @param rotationTolerance ε_ψ ≥ 0 in radians
 * @param costTolerance ε_J ≥ 0 in m²; converged when the cost changes by less; 0 is off
 */
record IcpParameters(
        double maxCorrespondenceDistance,
        double overlapRatio,
        double huberDelta,
        int maxIterations,
        double translationTolerance,
        double rotationTolerance,
        double costTolerance) {

    static final IcpParameters DEFAULTS = new IcpParameters(0.5, 0.85, 0.2, 60, 1e-6, 1e-6, 1e-12);

    IcpParameters {
        requirePositive("max_correspondence_distance", maxCorrespondenceDistance);
        require(
                0.0 < overlapRatio && overlapRatio <= 1.0,
                "overlap_ratio", "must be in (0, 1]", overlapRatio);
        requirePositive("huber_delta", huberDelta);
        require(maxIterations >= 1, "max_iterations", "must be >= 1", maxIterations);
        requireTolerance("translation_tolerance", translationTolerance);
        requireTolerance("rotation_tolerance", rotationTolerance);
        requireTolerance("cost_tolerance", costTolerance);
    }

    private static void requirePositive(String name, double value) {
        require(value > 0.0, name, "must be > 0", value);
    }

    private static void requireTolerance(String name, double value) {
        require(value >= 0.0 && Double.isFinite(value), name, "must be finite and >= 0", value);
    }

    private static void require(boolean holds, String name, String condition, Number received) {
        if (!holds) {
            throw new IllegalArgumentException(
                    "`" + name + "` " + condition + ", got " + received);
        }
    }
}
