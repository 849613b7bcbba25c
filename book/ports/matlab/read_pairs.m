function [p, q, w] = read_pairs(file)
%READ_PAIRS  Pairs of points and their weights from a file.
%   [P, Q, W] = READ_PAIRS(FILE) reads px,py,qx,qy or px,py,qx,qy,w a line: P and Q, N-by-2
%   [m], are the source's and the target's points, W, N-by-1, their weights, 1 by default.

rows = read_csv_strict(file, 5, '1');
p = rows(:, 1:2);
q = rows(:, 3:4);
w = rows(:, 5);
wrong = find(w < 0, 1);
if ~isempty(wrong)
    error('icp2d:file', '%s:%d: a weight must be at least 0, got %.15g', ...
        file, wrong, w(wrong));
end
end
