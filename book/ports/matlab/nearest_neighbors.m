function [index, distance] = nearest_neighbors(points, target)
%NEAREST_NEIGHBORS  The nearest target point of each point.
%   [INDEX, DISTANCE] = NEAREST_NEIGHBORS(POINTS, TARGET) finds, for each row of POINTS,
%   N-by-2, the row INDEX of TARGET, M-by-2, that is nearest, and how far it is: both
%   N-by-1, DISTANCE in the unit of the points [m]. Of equally near rows the first is taken.
%
%   All N*M distances are taken by subtraction, a block of points at a time so that memory
%   stays bounded. The target runs down the columns, where MIN finds its data in one piece.

count = size(points, 1);
index = zeros(count, 1);
squared = zeros(count, 1);
block = max(1, floor(2^20 / size(target, 1)));
for first = 1:block:count
    rows = first:min(first + block - 1, count);
    dx = target(:, 1) - points(rows, 1)';
    dy = target(:, 2) - points(rows, 2)';
    [nearest, where] = min(dx.^2 + dy.^2, [], 1);
    squared(rows) = nearest;
    index(rows) = where;
end
distance = sqrt(squared);
end
