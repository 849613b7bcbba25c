// Runs in QuickJS beside Python, over the parts of MathJax: draws one formula at a time.
MathJax.config.startup = {
  ...MathJax.config.startup,
  adaptor: "liteAdaptor",
  handler: "HTMLHandler",
};
Object.assign(MathJax.config.startup, {
  input: ["tex"],
  output: "svg",
  document: "<html><body></body></html>",
});
MathJax.config.svg = { ...MathJax.config.svg, fontCache: "global" };
MathJax.config.tex = {
  ...MathJax.config.tex,
  packages: MathJax._.input.tex.AllPackages.AllPackages.filter(
    (name) => !/^no(undefined|errors)$/.test(name),
  ),
  formatError: (_, error) => {
    throw error;
  },
};
MathJax.startup.getComponents();
MathJax.startup.makeMethods();

// What a page needs of a drawing: no names of its parts, no group around a single thing.
const lean = (node) => {
  const own = node.attributes ?? {};
  for (const name of Object.keys(own)) {
    if (/^data-(?!table|labels|line|frame)|^(role|focusable|id|xmlns.*)$/.test(name))
      delete own[name];
  }
  if (own["xlink:href"]) {
    own.href = own["xlink:href"].replace("MJX-TEX-", "g-");
    delete own["xlink:href"];
  }
  node.children = (node.children ?? []).flatMap((child) => {
    if (!child.children) return [child];
    lean(child);
    if (!child.children.length && /^(g|text)$/.test(child.kind)) return [];
    if (child.kind !== "g") return [child];
    const names = Object.keys(child.attributes);
    const inner = child.children;
    if (!names.length) return inner;
    const [only] = inner;
    if (
      inner.length > 1 ||
      names.join() !== "transform" ||
      only.attributes?.transform ||
      only.kind === "svg"
    )
      return [child];
    only.attributes = { ...child.attributes, ...only.attributes };
    return inner;
  });
};

// The drawing, its MathML, and the shapes of letters that no formula before has used.
let told = 0;
const draw = (tex, display) => {
  try {
    const { adaptor, output } = MathJax.startup;
    const [svg, spoken] = adaptor.childNodes(MathJax.tex2svg(tex, { display }));
    lean(svg);
    const shapes = adaptor.childNodes(output.fontCache.getCache());
    const fresh = shapes
      .slice(told)
      .map(({ attributes: { id, d } }) => [id.replace("MJX-TEX-", "g-"), d]);
    told = shapes.length;
    return JSON.stringify({
      svg: adaptor.outerHTML(svg),
      mathml: adaptor.innerHTML(spoken),
      shapes: fresh,
    });
  } catch (error) {
    return JSON.stringify({ error: error.message });
  }
};
