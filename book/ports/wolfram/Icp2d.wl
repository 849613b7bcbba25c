(* ::Package:: *)

(* Point-to-point ICP in the plane, after sections 3-5 of the lesson.

   A point is a complex number x + I y [m], a scan a list of them. A rigid motion is
   motion[u, t] with u = Exp[I theta] and t = x + I y, and moves points by being applied:
   motion[u, t][z] = u z + t. So T = Ttargetsource takes the source's points to the
   target's frame, and the dot and cross product of x and y are the two parts of
   Conjugate[x] y. The newer scan is the source, the older one the target. *)

BeginPackage["Icp2d`"];

If[StringMatchQ[$Version, "Mathics*"], (* it has no fast Nearest *)
  Get[FileNameJoin[{DirectoryName[ExpandFileName[$InputFileName]], "NearestInMathics.wl"}]]];

icp::usage = "icp[source, target] estimates the motion that takes the newer scan to the older one. Its options are those of Options[icp]: lengths in metres, angles in radians, Infinity turns a gate or delta off. It gives an Association with \"Motion\", \"Termination\", \"Iterations\", \"InlierCount\", \"Fitness\", \"InlierRmse\" [m] and \"Cost\" [m^2].";
alignPairs::usage = "alignPairs[p, q, w] is the motion that minimises Total[w Abs[T[p] - q]^2], in closed form, or degenerate[\"why\"] where the pairs leave the rotation open. alignPairs[p, q] weighs all pairs alike.";
associatePoints::usage = "associatePoints[source, target, T, parameters] finds, rejects and weighs the pairs at the pose T.";
integratePoses::usage = "integratePoses[start, increments] lists the poses {x, y, theta} [m, m, rad] that increments {dx, dy, dtheta} lead to, each in the frame of the pose before it.";
simulateScans::usage = "simulateScans[seed, n] gives an Association with \"Target\" and \"Source\", two simulated scans, the \"Truth\" and a \"Guess\", both poses {x, y, theta} [m, m, rad]. The scene has n points on each of two walls and 2 n between them; simulateScans[seed] takes the lesson's 150.";
motion::usage = "motion[u, t] turns by Arg[u] and then moves by t [m]; motion[u, t][z] moves the points z.";
degenerate::usage = "degenerate[\"why\"] stands for a motion that the pairs do not determine.";
compose::usage = "compose[Tab, Tbc] is the motion Tac: first the second, then the first.";
fromPose::usage = "fromPose[{x, y, theta}] is the motion of a pose [m, m, rad].";
toPose::usage = "toPose[T] is {x, y, theta} [m, m, rad] with theta in (-Pi, Pi].";
toPoints::usage = "toPoints[{{x, y}, ...}] makes points, complex numbers, of coordinates [m].";
wrapAngle::usage = "wrapAngle[theta] is the angle [rad] in (-Pi, Pi]; one that lies there comes back as it is.";
parameterRange::usage = "parameterRange[name] is {text, test} for an option of icp: its range in words and as a function.";

Begin["`Private`"];

(* Motions of the plane (section 2) *)

motion[u_, t_][z_] := u z + t

compose[motion[v_, s_], motion[u_, t_]] := motion[v u, v t + s]

fromPose[{x_, y_, theta_}] := motion[Exp[I N[theta]], x + I y]

toPose[motion[u_, t_]] := {Re[t], Im[t], wrapAngle[N[Arg[u]]]}

toPoints[coordinates_] := coordinates . {1, I}

wrapAngle[theta_] /; -Pi < theta <= Pi := theta
wrapAngle[theta_] := theta - N[2 Pi] Ceiling[(theta - Pi)/N[2 Pi]]


(* Alignment for fixed correspondences (section 3) *)

$relativeResolution = 1.*^-10; (* n products sum with an error of n epsilon: well below *)

alignPairs[p_, q_] := alignPairs[p, q, ConstantArray[1., Length[p]]]

alignPairs[_, _, w_] /; Total[w] <= 0 := degenerate["all weights are zero"]

alignPairs[p_, q_, w_] /; Min[w] <= 0 :=       (* a pair without weight says nothing *)
  alignPairs @@ (Pick[#, Positive[w]] & /@ {p, q, w})

alignPairs[p_, q_, w_] := Module[{pMean = mean[p, w], qMean = mean[q, w], x, y, c, u},
  {x, y} = {p - pMean, q - qMean};
  c = (w Conjugate[x]) . y;                    (* (2.5) + I (2.6): dot and cross product *)
  Which[
    coincideQ[p, x, w], degenerate["the source points coincide"],
    coincideQ[q, y, w], degenerate["the target points coincide"],
    Abs[c] <= $relativeResolution Total[w] spread[x, w] spread[y, w],
      degenerate["every rotation fits equally well"],
    True,
      u = Exp[I N[Arg[c]]];                    (* (2.7) *)
      motion[u, qMean - u pMean]]]             (* (2.3) *)

mean[z_, w_] := w . z/Total[w]

spread[z_, w_] := Sqrt[mean[Abs[z]^2, w]]

coincideQ[points_, centered_, w_] := spread[centered, w] <=
  Max[64 $MachineEpsilon largestCoordinate[points], $relativeResolution largestCoordinate[centered]]

largestCoordinate[z_] := Max[Abs[{Min[#], Max[#]}] & /@ {Re[z], Im[z]}]


(* Correspondences (section 4): associate, reject, weight *)

$minPairs = 3; (* the fewest that a step is computed from *)

associatePoints[source_, target_, T_, parameters_] :=
  associatePoints[source, target, nearestPositions[target], T, parameters]

associatePoints[source_, target_, nearest_, T_, parameters_] := Module[
  {moved = T[source], matched, distances, closest, kept, d},
  matched = target[[nearest[moved]]];
  distances = Abs[moved - matched];
  closest = overlap[distances, parameters["OverlapRatio"]];
  d = distances[[closest]];              (* in ascending order from here on *)
  kept = Take[closest, countWithin[d, parameters["MaxCorrespondenceDistance"]]];
  <|"Source" -> moved[[kept]],
    "Target" -> matched[[kept]],
    "Weights" -> huberWeights[Take[d, Length[kept]], parameters["HuberDelta"]],
    "InlierCount" -> Length[kept],
    "Fitness" -> N[Length[kept]/Length[source]],
    "InlierRmse" -> rootMeanSquare[Take[d, Length[kept]]],
    "Cost" -> cost[d, parameters]/Length[source]|>]

(* (A) how many of ascending distances lie within a limit, or on it: the gate *)
countWithin[d_, limit_] := Total[UnitStep[limit - d]]
countWithin[d_, Infinity] := Length[d]

(* (B) the closest share of all points; of equally close ones the first *)
overlap[distances_, ratio_] :=
  Take[SortBy[Range[Length[distances]], distances[[#]] &], overlapCount[Length[distances], ratio]]

overlapCount[n_, ratio_] := Min[n, Max[$minPairs, Floor[N[ratio] n]]]

(* (C) 1 up to delta, delta/d beyond, for ascending distances *)
huberWeights[d_, delta_] := With[{n = countWithin[d, delta]},
  Join[ConstantArray[1., n], delta/Drop[d, n]]]

huberLoss[d_, delta_] := With[{n = countWithin[d, delta]},
  Join[Take[d, n]^2, delta (2 Drop[d, n] - delta)]]

cost[d_, parameters_] := With[{gate = parameters["MaxCorrespondenceDistance"]},
  With[{n = countWithin[d, gate]},       (* beyond the gate as if on it *)
    Total[huberLoss[
      Join[Take[d, n], ConstantArray[gate, Length[d] - n]], parameters["HuberDelta"]]]]]

rootMeanSquare[{}] := Missing["NoPairs"]
rootMeanSquare[d_] := Sqrt[d . d/Length[d]]

(* a function that gives for points the positions of the nearest ones in the target *)
nearestPositions[target_] := If[StringMatchQ[$Version, "Mathics*"],
  NearestInMathics`nearestFinder[target],
  With[{nearest = Nearest[toCoordinates[target] -> "Index"]}, Min /@ nearest[toCoordinates[#]] &]]

toCoordinates[points_] := Transpose[{Re[points], Im[points]}]


(* The loop *)

Options[icp] = {
  "InitialPose" -> {0., 0., 0.},         (* {x, y, theta} [m, m, rad] *)
  "MaxCorrespondenceDistance" -> 0.5,    (* the gate [m] *)
  "OverlapRatio" -> 0.85,
  "HuberDelta" -> 0.2,                   (* [m] *)
  "MaxIterations" -> 60,
  "TranslationTolerance" -> 1.*^-6,      (* [m] *)
  "RotationTolerance" -> 1.*^-6,         (* [rad] *)
  "CostTolerance" -> 1.*^-12};           (* [m^2]; 0 turns the test off *)

parameterRange["InitialPose"] = {"three finite numbers", MatchQ[#, {Repeated[_Real | _Integer, {3}]}] &};
parameterRange["MaxCorrespondenceDistance" | "HuberDelta"] = {"above 0", # > 0 &};
parameterRange["OverlapRatio"] = {"in (0, 1]", 0 < # <= 1 &};
parameterRange["MaxIterations"] = {"a whole number, at least 1", # >= 1 && # == Floor[#] &};
parameterRange["TranslationTolerance" | "RotationTolerance" | "CostTolerance"] = {"at least 0", # >= 0 &};

icp::range = "`1` must be `2`, got `3`.";

icp[source_, target_, OptionsPattern[]] := Module[
  {parameters, wrong, names = ToString /@ First /@ Options[icp]},
  parameters = Association @@ Thread[names -> OptionValue[names]];
  wrong = Select[names, ! TrueQ[Last[parameterRange[#]][parameters[#]]] &];
  If[wrong === {},
    report[iterate[source, target, nearestPositions[target], parameters]],
    Message[icp::range, #, First[parameterRange[#]], parameters[#]] &[First[wrong]];
    $Failed]]

iterate[source_, target_, nearest_, parameters_] := With[
  {associate = associatePoints[source, target, nearest, #, parameters] &},
  NestWhile[
    step[#, associate, parameters] &,
    start[fromPose[parameters["InitialPose"]], associate],
    #["Termination"] === None &]]

start[T_, associate_] := With[{pairs = associate[T]},
  <|"Motion" -> T, "Pairs" -> pairs, "Iterations" -> 0, "Termination" -> checkPairs[pairs]|>]

step[state_, associate_, parameters_] :=
  advance[state, minimise[state["Pairs"]], associate, parameters]

minimise[pairs_] := alignPairs[pairs["Source"], pairs["Target"], pairs["Weights"]]

advance[state_, _degenerate, __] := Append[state, "Termination" -> "degenerate"]

advance[state_, dT_motion, associate_, parameters_] := Module[{T, now},
  T = compose[dT, state["Motion"]];      (* the update composes on the left *)
  now = <|"Motion" -> T, "Pairs" -> associate[T], "Iterations" -> state["Iterations"] + 1|>;
  Append[now, "Termination" -> checkConvergence[state, now, parameters]]]

checkPairs[pairs_] := If[pairs["InlierCount"] < $minPairs, "too_few_correspondences", None]

checkConvergence[before_, now_, parameters_] := Which[
  translationStep[before["Motion"], now["Motion"]] < parameters["TranslationTolerance"] &&
    rotationStep[before["Motion"], now["Motion"]] < parameters["RotationTolerance"],
    "converged_pose",                    (* estimated from enough pairs, whatever is left *)
  checkPairs[now["Pairs"]] =!= None,
    checkPairs[now["Pairs"]],
  Abs[now["Pairs"]["Cost"] - before["Pairs"]["Cost"]] < parameters["CostTolerance"],
    "converged_cost",
  now["Iterations"] >= parameters["MaxIterations"],
    "budget_spent",
  True, None]

translationStep[motion[_, s_], motion[_, t_]] := Abs[t - s]
rotationStep[motion[v_, _], motion[u_, _]] := Abs[Arg[u Conjugate[v]]]

(* A run that failed has no motion: never an identity in disguise. *)
report[state_] := <|
  "Motion" -> If[MemberQ[{"too_few_correspondences", "degenerate"}, state["Termination"]],
    Missing["Failed"], state["Motion"]],
  "Termination" -> state["Termination"],
  "Iterations" -> state["Iterations"],
  "InlierCount" -> state["Pairs"]["InlierCount"],
  "Fitness" -> state["Pairs"]["Fitness"],
  "InlierRmse" -> state["Pairs"]["InlierRmse"],
  "Cost" -> state["Pairs"]["Cost"]|>


(* From increments to poses (section 5) *)

(* FoldList[integrateStep, start, increments], which Mathics3 needs minutes for *)
integratePoses[start_, increments_] := Module[{steps = increments},
  First /@ NestList[
    {integrateStep[First[#], steps[[Last[#]]]], Last[#] + 1} &, {start, 1}, Length[steps]]]

integrateStep[{x_, y_, psi_}, {dx_, dy_, dpsi_}] :=
  With[{position = fromPose[{x, y, psi}][dx + I dy]},                      (* (5.4) *)
    {Re[position], Im[position], wrapAngle[psi + dpsi]}]                   (* (5.3) *)


(* The lesson's kind of scene *)

simulateScans[seed_Integer, n_Integer: 150] := Module[{world, truth = {0.35, 0.10, 6 Degree // N}},
  SeedRandom[seed];
  world = Join[RandomReal[{0, 8}, n], I RandomReal[{0, 6}, n], scattered[2 n]];
  <|"Target" -> scan[world, fromPose[{0, 0, 0}]],
    "Source" -> scan[world, fromPose[truth]],
    "Truth" -> truth,
    "Guess" -> {0.20, 0., 3 Degree // N}|>]

scattered[n_] := RandomReal[{0, 8}, n] + I RandomReal[{0, 6}, n]

(* What the scanner at the pose T sees: 10 m far, 135 degrees to either side *)
scan[world_, T_] := With[
  {seen = Select[invert[T][world], Abs[#] <= 10 && Abs[Arg[#]] <= 135 Degree &]},
  Join[seen + 0.01 gaussian[Length[seen]], spurious[Max[5, Quotient[Length[seen], 40]]]]]

invert[motion[u_, t_]] := motion[Conjugate[u], -Conjugate[u] t]

(* Box and Muller: two independent standard normal coordinates in one complex number *)
gaussian[n_] := Sqrt[-2 Log[1 - RandomReal[1, n]]] Exp[2. Pi I RandomReal[1, n]]

spurious[n_] := RandomReal[{-2, 2}, n] + I RandomReal[{-2, 2}, n]

End[];
EndPackage[];
