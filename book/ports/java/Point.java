/**
 * A point of the plane, or the vector between two of them, in metres.
 *
 * @param x metres
 * @param y metres
 */
record Point(double x, double y) {

    Point minus(Point other) {
        return new Point(x - other.x, y - other.y);
    }

    double dot(Point other) {
        return x * other.x + y * other.y;
    }

    /** The third component of the cross product: positive where {@code other} lies to the left. */
    double cross(Point other) {
        return x * other.y - y * other.x;
    }

    /** Length in metres; {@code Math.hypot} guards against overflow at many times the price. */
    double norm() {
        return Math.sqrt(dot(this));
    }

    double largestCoordinate() {
        return Math.max(Math.abs(x), Math.abs(y));
    }
}
