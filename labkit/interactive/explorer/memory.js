// What the browser keeps from one visit to the next: the bets, the sliders, the tasks that are done.

const STORE = "labkit-explorer";

const kept = () => {
  try {
    return JSON.parse(localStorage.getItem(STORE)) ?? {};
  } catch {
    return {}; // storage is forbidden or damaged: the explorer works, it only forgets
  }
};

export function recall(key) {
  return kept()[key] ?? null;
}

// Null forgets.
export function remember(key, value) {
  const { [key]: _, ...others } = kept();
  try {
    localStorage.setItem(STORE, JSON.stringify(value === null ? others : { ...others, [key]: value }));
  } catch {}
}

// Scenes of one name may hold other scans elsewhere; their first guess tells them apart.
const betKey = ({ name, guess }) => JSON.stringify([name, ...guess.map((each) => Number(each.toFixed(6)))]);

// Where the run will end as the reader bet it, one place [x, y] a scene; null without a bet.
export function storedBet(scene) {
  const place = recall(betKey(scene));
  return Array.isArray(place) && place.length === 2 && place.every(Number.isFinite) ? place : null;
}

export function storeBet(scene, place) {
  remember(betKey(scene), place);
}
