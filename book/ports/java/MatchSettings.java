import java.nio.file.Path;
import java.util.LinkedHashSet;
import java.util.List;
import java.util.Map;
import java.util.Set;

/**
 * What the parameter file of a match says.
 *
 * @param guess the initial pose of the source in the target
 * @param icp the parameters of the loop
 */
record MatchSettings(Pose guess, IcpParameters icp) {

    private static final Set<String> KEYS = new LinkedHashSet<>(List.of(
            "initial_x", "initial_y", "initial_theta",
            "max_correspondence_distance", "overlap_ratio", "huber_delta", "max_iterations",
            "translation_tolerance", "rotation_tolerance", "cost_tolerance"));

    /** Reads a flat JSON object; a key that is missing takes its default. */
    static MatchSettings read(Path file) throws InputException {
        Map<String, Double> given = Json.read(file, KEYS);
        try {
            return of(given);
        } catch (IllegalArgumentException problem) {
            throw new InputException(file, problem.getMessage());
        }
    }

    private static MatchSettings of(Map<String, Double> given) {
        IcpParameters defaults = IcpParameters.DEFAULTS;
        Pose guess = new Pose(
                number(given, "initial_x", 0.0),
                number(given, "initial_y", 0.0),
                number(given, "initial_theta", 0.0));
        IcpParameters icp = new IcpParameters(
                limit(given, "max_correspondence_distance", defaults.maxCorrespondenceDistance()),
                number(given, "overlap_ratio", defaults.overlapRatio()),
                limit(given, "huber_delta", defaults.huberDelta()),
                wholeNumber(given, "max_iterations", defaults.maxIterations()),
                number(given, "translation_tolerance", defaults.translationTolerance()),
                number(given, "rotation_tolerance", defaults.rotationTolerance()),
                number(given, "cost_tolerance", defaults.costTolerance()));
        return new MatchSettings(guess, icp);
    }

    private static double number(Map<String, Double> given, String key, double byDefault) {
        Double value = given.getOrDefault(key, byDefault);
        if (value == null) {
            throw new IllegalArgumentException("`" + key + "` must be a number, got null");
        }
        return value;
    }

    /** A number, or infinity for a null, which turns the limit off. */
    private static double limit(Map<String, Double> given, String key, double byDefault) {
        Double value = given.getOrDefault(key, byDefault);
        return value == null ? Double.POSITIVE_INFINITY : value;
    }

    /** A whole number such as 60 or 6e1; beyond the range of an int, the end of that range. */
    private static int wholeNumber(Map<String, Double> given, String key, int byDefault) {
        double value = number(given, key, byDefault);
        if (value != Math.rint(value)) {
            throw new IllegalArgumentException(
                    "`" + key + "` must be a whole number, got " + value);
        }
        return (int) value;
    }
}
