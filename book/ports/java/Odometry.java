import java.util.ArrayList;
import java.util.List;
import java.util.Optional;

/**
 * Scan-matching odometry (section 5): increments become poses, one scan at a time.
 *
 * <p>Between two scans an estimator holds the older one, the pose and the last motion: what the
 * lesson's Simulink block keeps in persistent variables.
 */
final class Odometry {

    private final IcpParameters parameters;
    private Pose pose;
    private List<Point> olderScan;
    private Pose lastMotion = Pose.ORIGIN;

    /** An estimator that stood at {@code start} in the world when it saw {@code firstScan} [m]. */
    Odometry(Pose start, List<Point> firstScan, IcpParameters parameters) {
        this.pose = start;
        this.olderScan = List.copyOf(firstScan);
        this.parameters = parameters;
    }

    /**
     * Takes the next scan, in metres, and expects the last motion once more.
     *
     * <p>Without a match the last motion is held, but once: nobody saw it, so it is no ground for
     * holding it again.
     *
     * @return the pose in the world at this scan
     */
    Pose update(List<Point> scan) {
        return update(scan, lastMotion, Pose.ORIGIN);
    }

    /**
     * Takes the next scan, in metres, and the motion that wheels or an IMU report since the last.
     *
     * @param prior in the frame of the scan before; also the motion taken where no match is found
     * @return the pose in the world at this scan
     */
    Pose update(List<Point> scan, Pose prior) {
        return update(scan, prior, prior);
    }

    private Pose update(List<Point> scan, Pose expected, Pose expectedAfterFailure) {
        Optional<Pose> matched = match(scan, expected);
        pose = step(pose, matched.orElse(expected));
        lastMotion = matched.orElse(expectedAfterFailure);
        olderScan = List.copyOf(scan);
        return pose;
    }

    /** The pose of {@code scan} in the older one; empty where they cannot be matched. */
    private Optional<Pose> match(List<Point> scan, Pose expected) {
        if (Math.min(scan.size(), olderScan.size()) < Correspondences.MIN_PAIRS) {
            return Optional.empty();
        }
        IcpResult result = new Icp(olderScan, parameters).match(scan, Transform.of(expected));
        return result.targetFromSource().map(Transform::toPose);
    }

    /** Moves {@code pose} by an increment (Δx, Δy, Δψ) that is given in the pose's own frame. */
    static Pose step(Pose pose, Pose increment) {
        Point position = Transform.of(pose).apply(new Point(increment.x(), increment.y())); // (5.4)
        return new Pose(position.x(), position.y(), pose.theta() + increment.theta()); // (5.3)
    }

    /** The start and the pose after each increment: K + 1 poses from K increments. */
    static List<Pose> integrate(Pose start, List<Pose> increments) {
        List<Pose> poses = new ArrayList<>(List.of(start));
        Pose pose = start;
        for (Pose increment : increments) {
            pose = step(pose, increment);
            poses.add(pose);
        }
        return poses;
    }
}
