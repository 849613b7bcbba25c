// The search: sections, terms, exercises and messages of errors in an index of lunr's, those first
// whose title or words fit best. It takes the place of the theme's, which knows whole pages and
// counts code. Below the field of Ctrl+K the first results show while one types.
(() => {
  const MAX_RESULTS = 20; // results
  const MAX_RESULTS_BELOW = 6; // of them below a field
  const CONTEXT_LETTERS = 90; // letters that are shown before a word that fits
  const FIELD_BOOSTS = { title: 3, page: 2, text: 1, greek: 1 };
  const KIND_BOOSTS = { message: 1.5, term: 1.3, section: 1, exercise: 0.5 };
  const ASIDE_PAGES = /^(book\/(api|decisions)|notebooks\/assignment)/;
  const ASIDE_BOOST = 0.4; // weight of pages aside, which few read for an answer
  const [PAGE, KIND, CHAPTER] = [0, 3, 6]; // columns of an entry
  const folder = document.documentElement.dataset.content_root;

  const load = (file) =>
    new Promise((loaded) => {
      const script = make("script", { src: `${folder}${file}` });
      script.addEventListener("load", loaded);
      document.head.append(script);
    });

  const indexOf = (entries) => {
    lunr.tokenizer.separator = /[^\p{L}\p{N}+]/u; // "c++" is a word
    return lunr(function () {
      this.pipeline.remove(lunr.trimmer); // it would cut Greek letters off
      this.ref("number");
      for (const [field, boost] of Object.entries(FIELD_BOOSTS)) this.field(field, { boost });
      entries.forEach(([page, pageTitle, , kind, title, text, , greek], number) => {
        const boost = KIND_BOOSTS[kind] * (ASIDE_PAGES.test(page) ? ASIDE_BOOST : 1);
        this.add({ number, title, page: pageTitle, text, greek }, { boost });
      });
    });
  };

  let loading = null;
  const prepare = async () => {
    await Promise.all([load("_static/lunr.js"), load("excerpts.js")]);
    const entries = window.labbookExcerpts;
    return { entries, index: indexOf(entries) };
  };

  // How well entries fit one word: whole, as a beginning, and with one letter as another.
  const fits = (index, word) =>
    index.query((terms) => {
      const { length } = word.toString();
      const beginning = { wildcard: lunr.Query.wildcard.TRAILING, usePipeline: false, boost: 2 };
      terms.term(word, { boost: 10 });
      if (length > 2) terms.term(word, beginning);
      if (length > 4) terms.term(word, { editDistance: 1 });
    });

  // Entries that fit, the best first. An entry with half of the words counts half.
  const find = async (query) => {
    loading ??= prepare();
    const { entries, index } = await loading;
    const queryWords = lunr.tokenizer(query).filter(lunr.stopWordFilter);
    const matches = new Map();
    for (const word of queryWords) {
      for (const { ref, score, matchData } of fits(index, word)) {
        const { sum, met, terms } = matches.get(ref) ?? { sum: 0, met: 0, terms: [] };
        terms.push(...Object.keys(matchData.metadata));
        matches.set(ref, { entry: entries[ref], sum: sum + score, met: met + 1, terms });
      }
    }
    const points = ({ sum, met }) => (sum * met) / queryWords.length;
    const results = [...matches.values()].sort((a, b) => points(b) - points(a));
    return withOneTermAhead(results).slice(0, MAX_RESULTS);
  };

  // The glossary says what a word means, and a chapter explains it: behind the best of its entries
  // stands the place in that chapter that fits best, and its other entries come later.
  const withOneTermAhead = (results) => {
    const isTerm = ({ entry }) => entry[KIND] === "term";
    const [term, ...otherTerms] = results.filter(isTerm);
    const places = results.filter((result) => !isTerm(result));
    if (!term) return places;
    const chapter = places.find(({ entry }) => entry[PAGE] === term.entry[CHAPTER]);
    const [nearest, ...farther] = places.filter((place) => place !== chapter);
    const isTermBest = results[0] === term;
    const head = isTermBest ? [term, chapter, nearest] : [nearest, term, chapter];
    const [second, third, ...rest] = farther; // before the glossary's other entries
    return [...head, second, third, ...otherTerms, ...rest].filter(Boolean);
  };

  const escaped = (text) => text.replace(/[.*+?^${}()|[\]\\]/g, "\\$&");

  const shown = ({ entry: [page, pageTitle, anchor, , title, text], terms }) => {
    const at = text.search(new RegExp(terms.map(escaped).join("|"), "i"));
    const from = Math.max(0, text.lastIndexOf(" ", Math.max(0, at - CONTEXT_LETTERS)));
    const href = `${folder}${page}.html${anchor ? `#${anchor}` : ""}`;
    const name = title === pageTitle ? title : `${title} – ${pageTitle}`;
    const excerpt = `${from ? "…" : ""}${text.slice(from, from + 2.5 * CONTEXT_LETTERS)}…`;
    return make("li", {}, make("a", { href }, name), make("p", { className: "context" }, excerpt));
  };

  const search = async (query, out, most = MAX_RESULTS) => {
    if (!query.trim()) {
      out.replaceChildren();
      return;
    }
    const list = (await find(query)).slice(0, most).map(shown);
    const heading = list.length
      ? `Found for “${query}”`
      : `Nothing found for “${query}”. Try another word, or the glossary.`;
    out.replaceChildren(make("h2", {}, heading), make("ul", { className: "search" }, ...list));
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
      if (!out) continue;
      field.addEventListener("focus", () => (loading ??= prepare()));
      field.addEventListener("input", async () => {
        const { value } = field;
        loading ??= prepare();
        await loading;
        if (value === field.value)
          search(value, out, out === results ? MAX_RESULTS : MAX_RESULTS_BELOW);
      });
    }
    const query = new URLSearchParams(location.search).get("q");
    if (query && results) search(query, results);
  });
})();
