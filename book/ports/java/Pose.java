/**
 * A position and a heading: of the robot in the world, or of one scan in another.
 *
 * <p>The heading is wrapped when a pose is made, so no pose ever holds one outside (−π, π].
 *
 * @param x metres
 * @param y metres
 * @param theta radians, counter-clockwise, in (−π, π]
 */
record Pose(double x, double y, double theta) {

    static final Pose ORIGIN = new Pose(0.0, 0.0, 0.0);

    Pose {
        theta = wrap(theta);
    }

    /** The same direction in (−π, π]; an angle that lies there comes back bit for bit. */
    private static double wrap(double radians) {
        if (-Math.PI < radians && radians <= Math.PI) {
            return radians;
        }
        double wrapped = Math.IEEEremainder(radians, 2.0 * Math.PI); // in [−π, π]
        return wrapped == -Math.PI ? Math.PI : wrapped;
    }
}
