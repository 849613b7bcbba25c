// Bets on where the run will end, one a scene, kept by the browser from one visit to the next.

const BETS = "labkit-bets";

const bets = () => {
  try {
    return JSON.parse(localStorage.getItem(BETS)) ?? {};
  } catch {
    return {}; // storage is forbidden or damaged: the explorer works, it only forgets
  }
};

// Scenes of one name may hold other scans elsewhere; their first guess tells them apart.
const betKey = ({ name, guess }) => JSON.stringify([name, ...guess.map((each) => Number(each.toFixed(6)))]);

// The place [x, y], or null.
export function storedBet(scene) {
  const place = bets()[betKey(scene)];
  return Array.isArray(place) && place.length === 2 && place.every(Number.isFinite) ? place : null;
}

export function storeBet(scene, place) {
  const { [betKey(scene)]: _, ...others } = bets();
  try {
    localStorage.setItem(BETS, JSON.stringify(place ? { ...others, [betKey(scene)]: place } : others));
  } catch {}
}
