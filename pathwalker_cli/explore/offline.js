// Knows what settings lead to without a solver: between solved points it interpolates, from there
// on it adds first-order changes, and it says which of the two it did.
const answer = (() => {
  const data = JSON.parse(document.getElementById("gait-data").textContent);
  const { steps, landscape } = data.offline;
  const home = Object.fromEntries(data.dials.map((dial) => [dial.key, dial.value]));
  const run = data.picture;
  let hear = () => {};
  let number = 0;

  // The weighted sum of states, the largest weight first: numbers are added, the rest is the first's.
  function sum(parts) {
    const [[, first]] = parts;
    if (typeof first === "number") return parts.reduce((all, [weight, value]) => all + weight * value, 0);
    if (parts.some(([, value]) => value === null || typeof value !== "object")) return typeof first === "string" ? first : null;
    const inside = (key) => sum(parts.map(([weight, value]) => [weight, value[key]]));
    if (Array.isArray(first)) return first.map((_, i) => inside(i));
    return Object.fromEntries(Object.keys(first).map((key) => [key, key === "shapes" ? first[key] : inside(key)]));
  }

  // Place between two values of an axis, in logarithms: the lower one's index and the share.
  function between(values, value) {
    const i = values.findIndex((edge, k) => k + 1 < values.length && value >= edge && value <= values[k + 1]);
    return i < 0 ? null : [i, Math.log(value / values[i]) / Math.log(values[i + 1] / values[i])];
  }

  // Solved points around a setting and their weights; null where they do not enclose it.
  function enclosing(settings) {
    const at = landscape.keys.map((keys, k) => {
      const values = keys.map((key) => settings[key]);
      return values.every((value) => Math.abs(value - values[0]) < 1e-9) ? between(landscape.values[k], values[0]) : null;
    });
    if (at.includes(null)) return null;
    const [[i, a], [j, b]] = at;
    const parts = [[(1 - a) * (1 - b), i, j], [a * (1 - b), i + 1, j], [(1 - a) * b, i, j + 1], [a * b, i + 1, j + 1]]
      .filter(([weight]) => weight > 1e-9).map(([weight, m, n]) => [weight, landscape.states[m][n]]);
    return parts.some(([, state]) => state === null) ? null : parts;
  }

  // Shares of cells between a setting and the run: near the run its own state counts too.
  function distance(settings) {
    return Math.max(...landscape.keys.map((keys, k) => {
      const [values, key] = [landscape.values[k], keys[0]];
      const cell = Math.log(values[values.length - 1] / values[0]) / (values.length - 1);
      return Math.abs(Math.log(settings[key] / home[key])) / cell;
    }));
  }

  function state(settings) {
    const moved = Object.keys(home).filter((key) => settings[key] !== home[key]);
    if (!moved.length) return { label: "the run", note: "solved", picture: run };
    const varied = landscape ? landscape.keys.flat() : [];
    const inside = landscape && moved.some((key) => varied.includes(key)) ? enclosing(settings) : null;
    const parts = inside || [[1, run]];
    if (inside) {
      const near = Math.max(0, 1 - distance(settings));
      const there = near && enclosing(home);
      if (there) parts.push([near, run], ...there.map(([weight, each]) => [-near * weight, each]));
    }
    const rest = inside ? moved.filter((key) => !varied.includes(key)) : moved;
    const missing = [];
    rest.forEach((key) => {
      const step = steps.find((each) => each.key === key);
      if (!step) { missing.push(key); return; }
      const share = (settings[key] - home[key]) / step.step;
      parts.push([share, step.state], [-share, run]);
    });
    parts.sort((one, other) => other[0] - one[0]);
    const words = {
      label: inside ? (rest.length ? "interpolated + first order" : inside.length === 1 ? "solved" : "interpolated") : "first order",
      note: inside ? `between solved points of the landscape; the springs that it does not vary are the problem's choice${rest.length ? "; the rest to first order from the run" : ""}`
        : `${landscape ? "outside the solved points: " : ""}the change from the run to first order, not solved; the further away, the less it holds`,
    };
    if (missing.length) words.note += `; not counted: ${missing.join(", ")}`;
    return { ...words, look: words.label === "solved" ? "" : "guess", picture: sum(parts) };
  }

  return {
    hear(listener) { hear = listener; },
    move(settings) {
      number += 1;
      hear({ kind: "moved", number, settings });
      hear({ kind: "solved", number, settings, ...state(settings) });
    },
  };
})();
