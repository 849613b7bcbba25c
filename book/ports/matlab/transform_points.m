function points_a = transform_points(T_a_b, points_b)
%TRANSFORM_POINTS  Move points from frame b to frame a.
%   POINTS_A = TRANSFORM_POINTS(T_A_B, POINTS_B) is R*p + t for each row p of POINTS_B,
%   N-by-2 [m]. The rows make the rotation a product with R' from the right.

points_a = points_b * T_a_b(1:2, 1:2)' + T_a_b(1:2, 3)';
end
