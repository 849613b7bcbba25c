import java.util.Optional;

/**
 * The outcome of one registration.
 *
 * @param targetFromSource the estimate; empty where the run failed, so no guess passes for one
 * @param termination how the run ended
 * @param iterations how many steps were taken
 * @param correspondences the last association, at the final pose
 */
record IcpResult(
        Optional<Transform> targetFromSource,
        Termination termination,
        int iterations,
        Correspondences correspondences) {}
