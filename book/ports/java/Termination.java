import java.util.Locale;

/** How a run of the loop ended. */
enum Termination {
    /** The last step was below both pose tolerances. */
    CONVERGED_POSE,
    /** The cost stopped changing. */
    CONVERGED_COST,
    /** Not converged, but an estimate. */
    BUDGET_SPENT,
    /** Fewer than 3 pairs are left; widen the gate or improve the guess. */
    TOO_FEW_CORRESPONDENCES,
    /** The pairs leave the motion undetermined. */
    DEGENERATE;

    /** Whether the run ended without an estimate. */
    boolean failed() {
        return switch (this) {
            case CONVERGED_POSE, CONVERGED_COST, BUDGET_SPENT -> false;
            case TOO_FEW_CORRESPONDENCES, DEGENERATE -> true;
        };
    }

    /** The word for it in an answer, such as {@code converged_pose}. */
    String word() {
        return name().toLowerCase(Locale.ROOT);
    }
}
