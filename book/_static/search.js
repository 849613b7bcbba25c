// The search: sections, terms and exercises, those first whose title or words fit best. It takes the
// place of the theme's, which knows whole pages, counts code and every "how" and "is".
(() => {
  const STOP = new Set("a an and are as at be by can do does for from has have how i in is it its me my of on or that the there this to was what when where which why with you your".split(" "));
  const MOST = 20, AROUND = 90; // results; letters about a word
  const folder = document.documentElement.dataset.content_root;
  const wordsOf = (text) => text.toLowerCase().match(/[\p{L}\p{N}δρψθ]+/gu) ?? [];
  const stem = (word) => (word.length > 4 ? word.replace(/(ations?|ing|ed|es|s)$/, "") : word);
  const escaped = (text) => text.replace(/[.*+?^${}()|[\]\\]/g, "\\$&");

  const asked = (query) => {
    const words = wordsOf(query), told = words.filter((each) => !STOP.has(each));
    return (told.length ? told : words).map(stem);
  };

  // How well a word fits a text: whole words count more than beginnings.
  const fit = (words, wanted) => words.reduce((sum, word) => sum + (stem(word) === wanted ? 1 : word.startsWith(wanted) && wanted.length > 2 ? 0.5 : 0), 0);

  let entries = null;
  const load = () =>
    (entries ??= new Promise((loaded) => {
      window.labbookExcerpts = (told) => loaded(told.map((each) => ({ all: each, title: wordsOf(each[3]), page: wordsOf(each[1]), text: wordsOf(each[4]) })));
      document.head.append(Object.assign(document.createElement("script"), { src: `${folder}excerpts.js` }));
    }));

  const find = async (query) => {
    const wanted = asked(query), known = await load();
    const phrase = wordsOf(query).join(" ").replace(/^((why|how|what|when|where|which|is|are|do|does|i|can|must) )+/, "");
    const rarity = wanted.map((word) => Math.log(1 + known.length / (1 + known.filter(({ title, text }) => fit(title, word) || fit(text, word)).length)));
    const scored = known.map((entry) => {
      let score = 0, met = 0;
      wanted.forEach((word, i) => {
        const inTitle = fit(entry.title, word), inText = fit(entry.text, word), inPage = fit(entry.page, word);
        met += inTitle || inText ? 1 : 0;
        score += rarity[i] * ((8 * Math.min(1, inTitle)) / Math.sqrt(entry.title.length || 1) + 2 * Math.min(1, inPage) + (3 * inText) / (inText + 1 + entry.text.length / 150));
      });
      const told = phrase.split(" ").length > 2 ? `${entry.title.join(" ")} ${entry.text.join(" ")}`.split(phrase).length - 1 : 0;
      return { entry, score: score * (met / wanted.length) ** 2 * (1 + (9 * told) / (told + 1)) };
    });
    return scored.filter(({ score }) => score > 0).sort((a, b) => b.score - a.score).slice(0, MOST);
  };

  const shown = ({ entry: { all: [page, pageTitle, anchor, title, text] } }, wanted) => {
    const at = text.search(new RegExp(wanted.map(escaped).join("|"), "i")), from = Math.max(0, text.lastIndexOf(" ", Math.max(0, at - AROUND)));
    const item = document.createElement("li"), link = document.createElement("a"), where = document.createElement("p");
    link.href = `${folder}${page}.html${anchor ? `#${anchor}` : ""}`;
    link.textContent = title === pageTitle ? title : `${title} – ${pageTitle}`;
    where.className = "context";
    where.textContent = `${from ? "…" : ""}${text.slice(from, from + 2.5 * AROUND)}…`;
    item.append(link, where);
    return item;
  };

  const search = async (query) => {
    const out = document.getElementById("search-results");
    if (!out) return;
    const found = await find(query), heading = document.createElement("h2"), list = document.createElement("ul");
    heading.textContent = found.length ? `Found for “${query}”` : `Nothing found for “${query}”. Try another word, or the glossary.`;
    list.className = "search";
    list.append(...found.map((each) => shown(each, asked(query))));
    out.replaceChildren(heading, list);
  };

  document.addEventListener("DOMContentLoaded", () => {
    if (typeof Search === "undefined") return;
    Search.performSearch = search;
    const field = document.querySelector("main input[name=q], article input[name=q]") ?? document.querySelector("input[name=q]");
    field?.addEventListener("input", () => field.value.trim() && search(field.value));
    const query = new URLSearchParams(location.search).get("q");
    if (query) search(query);
  });
})();
