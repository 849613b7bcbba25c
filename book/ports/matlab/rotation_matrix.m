function R = rotation_matrix(theta)
%ROTATION_MATRIX  The counter-clockwise rotation of the plane by an angle.
%   R = ROTATION_MATRIX(THETA) is 2-by-2 for a scalar THETA [rad].

R = [cos(theta), -sin(theta); sin(theta), cos(theta)];
end
