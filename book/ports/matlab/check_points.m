function check_points(points, name)
%CHECK_POINTS  Raise icp2d:points unless an array holds points of the plane.
%   CHECK_POINTS(POINTS, NAME) wants N-by-2 real and finite doubles with N >= 1; NAME is
%   what the message calls them.

if ~isa(points, 'double') || ~isreal(points) || ~ismatrix(points) || size(points, 2) ~= 2
    error('icp2d:points', '%s must be N-by-2 real doubles, got %s %s', ...
        name, strrep(mat2str(size(points)), ' ', ' by '), class(points));
end
if isempty(points)
    error('icp2d:points', '%s holds no points', name);
end
wrong = find(~all(isfinite(points), 2), 1);
if ~isempty(wrong)
    error('icp2d:points', '%s must be finite, got [%g, %g] in row %d', ...
        name, points(wrong, :), wrong);
end
end
