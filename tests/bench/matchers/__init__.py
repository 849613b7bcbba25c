"""The matchers, one adapter each, all with one signature.

``match(source, target, T_init, gate)`` takes points (N, 2) and (M, 2) [m], the guess of
``T_target_source`` (3, 3) and the gate [m], and returns the estimate (3, 3) and the number
of iterations, None where the library does not tell. Whatever a match needs (trees,
normals, a third dimension) is made inside the call, and so inside the timing. The lab's
own adapters take `labkit.Scan`, whose order is part of what they use.

Every adapter has the settings that a careful user would choose: of those tried on the
tuning pairs, the fastest ones that cost no accuracy.
"""
