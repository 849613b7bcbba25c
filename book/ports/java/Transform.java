/**
 * A rigid motion of the plane, p ↦ R p + t, that takes coordinates of one frame to another's.
 *
 * <p>The name of a variable says which: {@code aFromB} turns coordinates in b into coordinates in
 * a, and in {@code aFromB.after(bFromC)}, which is aFromC, equal letters meet.
 *
 * @param cos cosine of the angle of R
 * @param sin sine of the angle of R
 * @param x first component of t, metres
 * @param y second component of t, metres
 */
record Transform(double cos, double sin, double x, double y) {

    static Transform of(double x, double y, double theta) {
        return new Transform(Math.cos(theta), Math.sin(theta), x, y);
    }

    /** The motion from the frame that stands at {@code pose} to the frame the pose is given in. */
    static Transform of(Pose pose) {
        return of(pose.x(), pose.y(), pose.theta());
    }

    Pose toPose() {
        return new Pose(x, y, Math.atan2(sin, cos));
    }

    Point apply(Point p) {
        return new Point(cos * p.x() - sin * p.y() + x, sin * p.x() + cos * p.y() + y);
    }

    /** The product {@code this · first}: a point goes through {@code first}, then through this. */
    Transform after(Transform first) {
        return new Transform(
                cos * first.cos - sin * first.sin,
                sin * first.cos + cos * first.sin,
                cos * first.x - sin * first.y + x,
                sin * first.x + cos * first.y + y);
    }

    /** The way back, by structure: Rᵀ and −Rᵀ t. */
    Transform inverse() {
        return new Transform(cos, -sin, -(cos * x + sin * y), sin * x - cos * y);
    }

    /** How far the origin lies from where {@code other} puts it, in metres. */
    double translationFrom(Transform other) {
        return Math.hypot(x - other.x, y - other.y);
    }

    /** The angle between this heading and that of {@code other}, in radians, in [0, π]. */
    double rotationFrom(Transform other) {
        return Math.abs(Math.atan2(
                other.cos * sin - other.sin * cos, other.cos * cos + other.sin * sin));
    }
}
