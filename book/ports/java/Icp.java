import java.util.List;
import java.util.Optional;

/**
 * The robust ICP loop (section 4 of the lesson), its stages in the flow chart's order.
 *
 * <p>A matcher holds the older scan, the target, sorted for search; match as many newer scans
 * against it as you like.
 */
final class Icp {

    private final NearestNeighbors target;
    private final IcpParameters parameters;

    /** The state after a number of steps; number 0 is the guess. */
    private record Iteration(int number, Transform targetFromSource, Correspondences pairs) {}

    /** Prepares the older scan, at least one point in metres. */
    Icp(List<Point> target, IcpParameters parameters) {
        this.target = new NearestNeighbors(target);
        this.parameters = parameters;
    }

    /**
     * Estimates the motion that maps the newer scan onto the older one.
     *
     * @param source the newer scan, at least one point in metres
     * @param guess an initial {@code targetFromSource}, from wheels or an IMU
     */
    IcpResult match(List<Point> source, Transform guess) {
        if (source.isEmpty()) {
            throw new IllegalArgumentException("the source scan is empty");
        }
        Iteration now = new Iteration(0, guess, associate(source, guess)); // D, E
        Optional<Termination> termination = check(now.pairs());
        while (termination.isEmpty()) {
            Iteration before = now;
            try {
                Transform update = minimise(before.pairs()); // F
                Transform targetFromSource = update.after(before.targetFromSource()); // G: left
                Correspondences pairs = associate(source, targetFromSource); // D, E
                now = new Iteration(before.number() + 1, targetFromSource, pairs);
                termination = check(before, now); // H
            } catch (DegenerateAlignmentException undetermined) {
                termination = Optional.of(Termination.DEGENERATE);
            }
        }
        return result(now, termination.get()); // I
    }

    private Correspondences associate(List<Point> source, Transform targetFromSource) {
        return Correspondences.associate(source, target, targetFromSource, parameters);
    }

    private static Transform minimise(Correspondences pairs) throws DegenerateAlignmentException {
        return Alignment.align(pairs.kept());
    }

    /** Why no step can come from {@code pairs}; empty where one can. */
    private static Optional<Termination> check(Correspondences pairs) {
        return pairs.inlierCount() < Correspondences.MIN_PAIRS
                ? Optional.of(Termination.TOO_FEW_CORRESPONDENCES)
                : Optional.empty();
    }

    /**
     * Why to stop after a step; empty to go on.
     *
     * <p>The two pose tests hold together: a scan that turns about its own centre hardly moves from
     * the first step on, and under "either of them" it would stop there. They come before the count
     * of pairs: the pose was estimated from enough of them.
     */
    private Optional<Termination> check(Iteration before, Iteration now) {
        Transform pose = now.targetFromSource();
        if (pose.translationFrom(before.targetFromSource()) < parameters.translationTolerance()
                && pose.rotationFrom(before.targetFromSource()) < parameters.rotationTolerance()) {
            return Optional.of(Termination.CONVERGED_POSE);
        }
        Optional<Termination> noStep = check(now.pairs());
        if (noStep.isPresent()) {
            return noStep;
        }
        double costChange = Math.abs(now.pairs().cost() - before.pairs().cost());
        if (costChange < parameters.costTolerance()) { // never, where the tolerance is 0
            return Optional.of(Termination.CONVERGED_COST);
        }
        return now.number() >= parameters.maxIterations()
                ? Optional.of(Termination.BUDGET_SPENT)
                : Optional.empty();
    }

    private static IcpResult result(Iteration last, Termination termination) {
        Optional<Transform> estimate =
                termination.failed() ? Optional.empty() : Optional.of(last.targetFromSource());
        return new IcpResult(estimate, termination, last.number(), last.pairs());
    }
}
