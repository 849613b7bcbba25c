import java.io.FileDescriptor;
import java.io.FileOutputStream;
import java.io.PrintStream;
import java.nio.charset.StandardCharsets;
import java.nio.file.InvalidPathException;
import java.nio.file.Path;
import java.util.LinkedHashMap;
import java.util.List;
import java.util.Map;
import java.util.Optional;
import java.util.SplittableRandom;

/** The command line: one command in, one line of JSON out. */
public final class Icp2d {

    private static final String USAGE = "usage: icp2d match TARGET.csv SOURCE.csv PARAMETERS.json"
            + " | align PAIRS.csv | integrate INCREMENTS.csv X Y THETA | demo SEED"
            + " | batch COMMANDS.txt";
    private static final long LARGEST_SEED = 0xFFFF_FFFFL;
    private static final int BAD_INPUT = 1;
    private static final int WRONG_USAGE = 2;
    private static final Path HERE = Path.of("");

    private final Path folder; // that relative paths start from

    private Icp2d(Path folder) {
        this.folder = folder;
    }

    /** Runs one command; errors are one line on standard error and a status that is not 0. */
    public static void main(String[] arguments) {
        PrintStream out = utf8(FileDescriptor.out);
        PrintStream err = utf8(FileDescriptor.err);
        int status = 0;
        try {
            if (arguments.length == 2 && arguments[0].equals("batch")) {
                batch(arguments[1], out);
            } else {
                out.println(new Icp2d(HERE).answer(List.of(arguments)));
            }
        } catch (InputException problem) {
            err.println("icp2d: " + onOneLine(problem));
            status = BAD_INPUT;
        } catch (UsageException problem) {
            err.println("icp2d: " + onOneLine(problem));
            status = WRONG_USAGE;
        }
        out.flush();
        System.exit(status);
    }

    /** Answers every line of a file; a command that fails does not stop the rest. */
    private static void batch(String name, PrintStream out) throws InputException, UsageException {
        Path file = new Icp2d(HERE).path(name);
        Path folder = Optional.ofNullable(file.getParent()).orElse(HERE);
        Icp2d icp2d = new Icp2d(folder);
        for (String line : Csv.lines(file)) {
            try {
                out.println(icp2d.answer(List.of(line.strip().split("\\s+"))));
            } catch (InputException | UsageException problem) {
                out.println(Json.write(Map.of("error", onOneLine(problem))));
            }
        }
    }

    private String answer(List<String> command) throws InputException, UsageException {
        Map<String, Object> members = switch (signature(command)) {
            case "match 3" -> match(
                    path(command.get(1)), path(command.get(2)), path(command.get(3)));
            case "align 1" -> align(path(command.get(1)));
            case "integrate 4" -> integrate(
                    path(command.get(1)),
                    new Pose(number(command.get(2)), number(command.get(3)), number(command.get(4))));
            case "demo 1" -> demo(seed(command.get(1)));
            default -> throw new UsageException(USAGE);
        };
        return Json.write(members);
    }

    /** The command's word and how many arguments follow it. */
    private static String signature(List<String> command) {
        return command.isEmpty() ? "" : command.get(0) + " " + (command.size() - 1);
    }

    private static Map<String, Object> match(Path target, Path source, Path parameters)
            throws InputException {
        List<Point> targetPoints = Csv.points(target);
        List<Point> sourcePoints = Csv.points(source);
        MatchSettings settings = MatchSettings.read(parameters);
        IcpResult result = new Icp(targetPoints, settings.icp())
                .match(sourcePoints, Transform.of(settings.guess()));

        Map<String, Object> answer = pose(result.targetFromSource());
        answer.put("termination", result.termination().word());
        answer.put("iterations", result.iterations());
        answer.put("inlier_count", result.correspondences().inlierCount());
        answer.put("fitness", result.correspondences().fitness());
        answer.put("inlier_rmse", result.correspondences().inlierRmse());
        answer.put("cost", result.correspondences().cost());
        return answer;
    }

    private static Map<String, Object> align(Path pairs) throws InputException {
        List<Pair> given = Csv.pairs(pairs);
        try {
            return pose(Optional.of(Alignment.align(given)));
        } catch (DegenerateAlignmentException outcome) {
            return Map.of("error", "degenerate: " + outcome.getMessage());
        }
    }

    private static Map<String, Object> integrate(Path increments, Pose start)
            throws InputException {
        List<Pose> poses = Odometry.integrate(start, Csv.increments(increments));
        return Map.of("poses", poses.stream().map(Icp2d::triple).toList());
    }

    /** The lesson's experiment: 6° and (0.35, 0.10) m, guessed as 3° and (0.20, 0) m. */
    private static Map<String, Object> demo(long seed) {
        SplittableRandom random = new SplittableRandom(seed);
        Transform truth = Transform.of(0.35, 0.10, Math.toRadians(6.0));
        Transform guess = Transform.of(0.20, 0.0, Math.toRadians(3.0));
        List<Point> world = Simulation.world(random);
        List<Point> target = Simulation.scan(world, Transform.of(Pose.ORIGIN), random);
        List<Point> source = Simulation.scan(world, truth, random);
        IcpResult result = new Icp(target, IcpParameters.DEFAULTS).match(source, guess);

        Map<String, Object> answer = new LinkedHashMap<>();
        answer.put("truth", triple(truth.toPose()));
        answer.put("estimate", result.targetFromSource().map(t -> triple(t.toPose())).orElse(null));
        answer.put("iterations", result.iterations());
        answer.put("termination", result.termination().word());
        answer.put("inlier_count", result.correspondences().inlierCount());
        answer.put("inlier_rmse", result.correspondences().inlierRmse());
        return answer;
    }

    private static Map<String, Object> pose(Optional<Transform> transform) {
        Optional<Pose> pose = transform.map(Transform::toPose);
        Map<String, Object> answer = new LinkedHashMap<>();
        answer.put("x", pose.map(Pose::x).orElse(null));
        answer.put("y", pose.map(Pose::y).orElse(null));
        answer.put("theta", pose.map(Pose::theta).orElse(null));
        return answer;
    }

    private static List<Double> triple(Pose pose) {
        return List.of(pose.x(), pose.y(), pose.theta());
    }

    private Path path(String name) throws UsageException {
        try {
            return folder.resolve(name);
        } catch (InvalidPathException problem) {
            throw new UsageException(problem.getMessage());
        }
    }

    private static double number(String argument) throws UsageException {
        try {
            return Decimal.parse(argument);
        } catch (NumberFormatException problem) {
            throw new UsageException(problem.getMessage());
        }
    }

    private static long seed(String argument) throws UsageException {
        if (argument.matches("[0-9]{1,10}") && Long.parseLong(argument) <= LARGEST_SEED) {
            return Long.parseLong(argument);
        }
        throw new UsageException("the seed must be a whole number from 0 to 2^32 - 1, got "
                + Decimal.quote(argument));
    }

    private static String onOneLine(Exception problem) {
        return problem.getMessage().replaceAll("\\p{Cntrl}+", " ");
    }

    private static PrintStream utf8(FileDescriptor descriptor) {
        return new PrintStream(new FileOutputStream(descriptor), false, StandardCharsets.UTF_8);
    }

    /** Words on the command line that make no command. */
    private static final class UsageException extends Exception {

        private static final long serialVersionUID = 1L;

        UsageException(String message) {
            super(message);
        }
    }
}
