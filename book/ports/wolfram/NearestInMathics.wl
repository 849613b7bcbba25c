(* ::Package:: *)

(* The search for the nearest point, for Mathics3, which has no packed arrays: its own Nearest
   takes 2 ms for each distance. Mathematica never loads this file.

   The target is split into small groups, each in a circle. A circle whose near side lies beyond
   another one's far side cannot hold the nearest point, nor the second nearest. And while a
   point has moved by less than half the lead of the nearest over the second nearest, the answer
   stands. Both are exact: every point gets the nearest, of equally near ones the first. *)

BeginPackage["NearestInMathics`"];

nearestFinder::usage = "nearestFinder[target] is a function that gives for a list of points the positions of the nearest ones in target; points are complex numbers. It remembers its last answers.";

Begin["`Private`"];

$groupSize = 14; (* points; time is short where the groups are about as many *)

(* Long lists stand in local symbols, and a search sets none: Mathics3 walks through every list
   that is written out in a body, and evaluates all lists anew after anything was set. *)
nearestFinder[points_] := Module[
  {target = points, groups, centres, radii, find, asked = {}, indices, leads, todo, found},
  groups = split[target, Range[Length[target]]];
  {centres, radii} = Transpose[circle[target[[#]]] & /@ groups];

  (* {position of the nearest, its lead over the second nearest [m]} *)
  find[query_] := With[{gaps = Abs[centres - query]},
    With[{near = Sort[Join @@ Pick[groups, UnitStep[(1 + 1.*^-12) Min[gaps + radii] + radii - gaps], 1]]},
      With[{distances = Abs[target[[near]] - query]},
        With[{least = Min[distances]},
          {near[[First[FirstPosition[distances, least]]]], lead[distances, least]}]]]];

  Function[queries,
    todo = If[Length[asked] == Length[queries],
      Pick[Range[Length[queries]], UnitStep[2 Abs[queries - asked] - leads], 1],
      asked = queries; indices = leads = Range[Length[queries]]];
    found = find /@ queries[[todo]];
    asked = ReplacePart[asked, Thread[todo -> queries[[todo]]]];
    indices = ReplacePart[indices, Thread[todo -> found[[All, 1]]]];
    leads = ReplacePart[leads, Thread[todo -> found[[All, 2]]]];
    indices]]

(* halves at the median of the wider axis, until few are left *)
split[_, group_] /; Length[group] <= $groupSize := {group}
split[target_, group_] := With[{coordinates = wider[Re[target[[group]]], Im[target[[group]]]]},
  With[{order = SortBy[Range[Length[group]], coordinates[[#]] &], half = Quotient[Length[group], 2]},
    Join[split[target, Sort[group[[Take[order, half]]]]], split[target, Sort[group[[Drop[order, half]]]]]]]]

wider[x_, y_] := If[Max[x] - Min[x] >= Max[y] - Min[y], x, y]

(* {centre, radius} *)
circle[points_] := With[{centre = Total[points]/Length[points]}, {centre, Max[Abs[points - centre]]}]

lead[{_}, _] := Infinity
lead[distances_, least_] := (1 - 1.*^-12) (RankedMin[distances, 2] - least)

End[];
EndPackage[];
