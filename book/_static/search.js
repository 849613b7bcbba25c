// The search: sections, terms and exercises, those first whose title or words fit best. It takes
// the place of the theme's, which knows whole pages, counts code and every "how" and "is". Below
// the field of Ctrl+K the first results show while one types.
(() => {
  const STOP = new Set(
    (
      "a an and are as at be by can do does for from has have how i in is it its me must my of " +
      "on or should that the there this to was what when where which why with you your"
    ).split(" "),
  );
  const MOST = 20;
  const BELOW = 6;
  const AROUND = 90; // results, those below a field; letters about a word
  // A row holds words that mean the same here; what is asked by one is found by the others, for
  // less.
  const SAME = [
    "install installation setup start environment python",
    "windows mac linux powershell",
    "kd tree search nearest neighbour neighbor",
    "composition compose composed order left",
    "delta δ",
    "rho ρ",
    "psi ψ",
    "angle heading yaw rotation turn",
    "initial guess prior start",
    "cite citation references literature bibliography paper bibtex",
    "submit submission hand upload deliver",
    "late deadline lateness",
    "grade mark points score grading",
    "error wrong help problem stuck crash fails",
    "trim trimming trimmed overlap",
    "outlier robust huber",
    "uncertainty covariance confidence",
    "corridor degenerate degeneracy unobservable",
    "speed fast time slow runtime",
    "c++ java matlab wolfram language port",
    "map slam loop closure graph",
    "stop converge convergence termination",
  ].map((row) => row.split(" "));
  const WEIGHT = [
    [/^(book\/(api|decisions|benchmark)|notebooks\/assignment)/, 0.35],
    [/^book\/(instructors|errata|languages)/, 0.75],
    [/^book\/(glossary|students)/, 1.4],
    [/^notebooks\/(0[1-8]|10)/, 1.15],
  ];
  const folder = document.documentElement.dataset.content_root;
  const wordsOf = (text) => text.toLowerCase().match(/[\p{L}\p{N}δρψθ+]+/gu) ?? [];
  const stem = (word) =>
    word.length > 4
      ? word
          .replace(/(ations?|ions?|ings?|ments?|ed|es|ers?|s)$/, "")
          .replace(/([^aeiou])\1$/, "$1")
      : word;
  const escaped = (text) => text.replace(/[.*+?^${}()|[\]\\]/g, "\\$&");
  const alike = new Map();
  for (const row of SAME)
    for (const word of row)
      alike.set(stem(word), [...(alike.get(stem(word)) ?? []), ...row.map(stem)]);

  const asked = (query) => {
    const words = wordsOf(query);
    const told = words.filter((each) => !STOP.has(each));
    return (told.length ? told : words).map(stem);
  };

  // How well a word fits a text: whole words count more than beginnings, and these more than others
  // of its meaning.
  const fit = (stems, wanted) => {
    const own = stems.reduce(
      (sum, each) =>
        sum + (each === wanted ? 1 : each.startsWith(wanted) && wanted.length > 2 ? 0.5 : 0),
      0,
    );
    return own || (stems.some((each) => alike.get(wanted)?.includes(each)) ? 0.7 : 0);
  };

  let entries = null;
  const load = () =>
    (entries ??= new Promise((loaded) => {
      const of = (text) => wordsOf(text).map(stem);
      window.labbookExcerpts = (told) =>
        loaded(
          told.map((each) => ({
            all: each,
            title: of(each[3]),
            page: of(each[1]),
            text: of(each[4]),
            words: wordsOf(`${each[3]} ${each[4]}`).join(" "),
            weight:
              (WEIGHT.find(([pages]) => pages.test(each[0]))?.[1] ?? 1) *
              (each[2].startsWith("ex-") ? 0.6 : 1),
          })),
        );
      document.head.append(make("script", { src: `${folder}excerpts.js` }));
    }));

  const find = async (query) => {
    const wanted = asked(query);
    const known = await load();
    const phrase = wordsOf(query)
      .join(" ")
      .replace(/^((why|how|what|when|where|which|is|are|do|does|i|can|must) )+/, "");
    const rarity = wanted.map((word) =>
      Math.log(
        1 +
          known.length /
            (1 +
              known.filter(({ title, text }) => title.includes(word) || text.includes(word))
                .length),
      ),
    );
    const scored = known.map((entry) => {
      let score = 0;
      let met = 0;
      wanted.forEach((word, i) => {
        const inTitle = fit(entry.title, word);
        const inText = fit(entry.text, word);
        const inPage = fit(entry.page, word);
        met += Math.min(1, Math.max(inTitle, inText, 0.8 * inPage));
        score +=
          rarity[i] *
          ((8 * Math.min(1, inTitle)) / Math.sqrt(entry.title.length || 1) +
            2 * Math.min(1, inPage) +
            (3 * inText) / (inText + 1 + entry.text.length / 150));
      });
      const told = phrase.split(" ").length > 2 ? entry.words.split(phrase).length - 1 : 0;
      return {
        entry,
        score: entry.weight * score * (met / wanted.length) ** 2 * (1 + (9 * told) / (told + 1)),
      };
    });
    return scored
      .filter(({ score }) => score > 0)
      .sort((a, b) => b.score - a.score)
      .slice(0, MOST);
  };

  const shown = (
    {
      entry: {
        all: [page, pageTitle, anchor, title, text],
      },
    },
    wanted,
  ) => {
    const at = text.search(new RegExp(wanted.map(escaped).join("|"), "i"));
    const from = Math.max(0, text.lastIndexOf(" ", Math.max(0, at - AROUND)));
    const href = `${folder}${page}.html${anchor ? `#${anchor}` : ""}`;
    const name = title === pageTitle ? title : `${title} – ${pageTitle}`;
    const where = `${from ? "…" : ""}${text.slice(from, from + 2.5 * AROUND)}…`;
    return make("li", {}, make("a", { href }, name), make("p", { className: "context" }, where));
  };

  const search = async (query, out, most = MOST) => {
    if (!out) return;
    const found = query.trim() ? await find(query) : [];
    const list = found.slice(0, most).map((each) => shown(each, asked(query)));
    const told = found.length
      ? `Found for “${query}”`
      : `Nothing found for “${query}”. Try another word, or the glossary.`;
    out.replaceChildren(
      ...(query.trim() ? [make("h2", {}, told), make("ul", { className: "search" }, ...list)] : []),
    );
  };

  document.addEventListener("DOMContentLoaded", () => {
    const results = document.getElementById("search-results");
    if (typeof Search !== "undefined") Search.performSearch = (query) => search(query, results);
    for (const field of document.querySelectorAll("input[name=q]")) {
      let out = results;
      if (field.closest(".search-button__search-container")) {
        out = make("div", { className: "search-below" });
        out.setAttribute("role", "status");
        field.form.after(out);
      }
      field.addEventListener("input", async () => {
        const { value } = field;
        await load();
        if (value === field.value) search(value, out, out === results ? MOST : BELOW);
      });
    }
    const query = new URLSearchParams(location.search).get("q");
    if (query && results) search(query, results);
  });
})();
