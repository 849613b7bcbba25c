import java.util.Arrays;
import java.util.Comparator;
import java.util.List;

/**
 * Nearest-neighbour search in a target scan: built once, asked often (box D of the flow chart).
 *
 * <p>A KD-tree without nodes: an array holds the points in an order in which the middle of every
 * range splits it, by x and by y in turn. It answers as a look at all points would, bit for bit,
 * and of equally near points it gives the one that comes first in the target.
 */
final class NearestNeighbors {

    private static final Comparator<Entry> BY_X = Comparator.comparingDouble(e -> e.point().x());
    private static final Comparator<Entry> BY_Y = Comparator.comparingDouble(e -> e.point().y());

    /** A target point [m] and its row in the target. */
    private record Entry(Point point, int row) {}

    private final Entry[] tree;

    /** Sorts the points of {@code target}, in metres; at least one. */
    NearestNeighbors(List<Point> target) {
        if (target.isEmpty()) {
            throw new IllegalArgumentException("the target scan is empty");
        }
        tree = new Entry[target.size()];
        Arrays.setAll(tree, row -> new Entry(target.get(row), row));
        split(tree, 0, tree.length, true);
    }

    private static void split(Entry[] tree, int from, int to, boolean byX) {
        if (to - from < 2) {
            return;
        }
        Arrays.sort(tree, from, to, byX ? BY_X : BY_Y);
        int middle = (from + to) >>> 1;
        split(tree, from, middle, !byX);
        split(tree, middle + 1, to, !byX);
    }

    /** The target point nearest to {@code point}, which is given in the target's frame. */
    Point nearest(Point point) {
        return search(point, 0, tree.length, true, tree[0]).point();
    }

    /** The nearest of the range [from, to) of the tree and the {@code best} so far. */
    private Entry search(Point point, int from, int to, boolean byX, Entry best) {
        if (from >= to) {
            return best;
        }
        int middle = (from + to) >>> 1;
        Point offset = point.minus(tree[middle].point());
        double gap = byX ? offset.x() : offset.y();
        boolean below = gap < 0.0;
        best = nearer(point, tree[middle], best);
        best = below
                ? search(point, from, middle, !byX, best)
                : search(point, middle + 1, to, !byX, best);
        if (gap * gap > squaredDistance(point, best)) {
            return best; // what lies beyond the split is farther than that
        }
        return below
                ? search(point, middle + 1, to, !byX, best)
                : search(point, from, middle, !byX, best);
    }

    private static Entry nearer(Point point, Entry candidate, Entry best) {
        int order = Double.compare(
                squaredDistance(point, candidate), squaredDistance(point, best));
        return order < 0 || (order == 0 && candidate.row() < best.row()) ? candidate : best;
    }

    private static double squaredDistance(Point point, Entry entry) {
        Point offset = point.minus(entry.point());
        return offset.dot(offset);
    }
}
