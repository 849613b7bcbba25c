"""The ICP explorer, and its three sliders alone: a widget whose page computes the loop itself.

The front end stands in the ``*.js`` files beside this one. `icp.js` and what it imports
mirror labkit's modules, function by function, and are held to them by the tests; the rest draws.
"""
