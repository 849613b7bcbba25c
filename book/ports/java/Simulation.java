import java.util.ArrayList;
import java.util.List;
import java.util.random.RandomGenerator;

/**
 * The lesson's own kind of scene (section 6): an L of two walls, scatter, and scans of them.
 *
 * <p>No ray is cast. A scan is all world points in reach, with noise and a few spurious returns;
 * behind a wall it goes on. Lengths are metres, angles radians.
 */
final class Simulation {

    private static final double WIDTH = 8.0;
    private static final double DEPTH = 6.0;
    private static final int WALL_POINTS = 150;
    private static final int SCATTERED_POINTS = 300;

    private static final double REACH = 10.0;
    private static final double HALF_FIELD_OF_VIEW = Math.toRadians(135.0);
    private static final double NOISE = 0.01; // standard deviation on each coordinate
    private static final double CLUTTER = 2.0; // spurious returns lie within ± this
    private static final int MIN_CLUTTER = 5;
    private static final int POINTS_PER_CLUTTER = 40;

    private Simulation() {}

    /** The points of the two walls and of what stands between them. */
    static List<Point> world(RandomGenerator random) {
        List<Point> world = new ArrayList<>();
        for (int i = 0; i < WALL_POINTS; i++) {
            world.add(new Point(random.nextDouble(0.0, WIDTH), 0.0));
            world.add(new Point(0.0, random.nextDouble(0.0, DEPTH)));
        }
        for (int i = 0; i < SCATTERED_POINTS; i++) {
            world.add(new Point(random.nextDouble(0.0, WIDTH), random.nextDouble(0.0, DEPTH)));
        }
        return world;
    }

    /** What a scanner that stands at {@code worldFromScanner} measures, in its own frame. */
    static List<Point> scan(
            List<Point> world, Transform worldFromScanner, RandomGenerator random) {
        Transform scannerFromWorld = worldFromScanner.inverse();
        List<Point> scan = new ArrayList<>();
        for (Point point : world) {
            Point seen = scannerFromWorld.apply(point);
            if (inReach(seen)) {
                scan.add(new Point(
                        random.nextGaussian(seen.x(), NOISE),
                        random.nextGaussian(seen.y(), NOISE)));
            }
        }
        int clutter = Math.max(MIN_CLUTTER, scan.size() / POINTS_PER_CLUTTER);
        for (int i = 0; i < clutter; i++) {
            scan.add(new Point(
                    random.nextDouble(-CLUTTER, CLUTTER), random.nextDouble(-CLUTTER, CLUTTER)));
        }
        return scan;
    }

    private static boolean inReach(Point seen) {
        double bearing = Math.atan2(seen.y(), seen.x());
        return seen.norm() <= REACH && Math.abs(bearing) <= HALF_FIELD_OF_VIEW;
    }
}
