// Load what draws the widgets once one of them comes near: megabytes that a page does not need
// to be read. All files lie beside this one, at any page depth, also on file://.
(() => {
  const vendor = new URL("vendor/", document.currentScript.src).href;
  const load = (file) =>
    new Promise((resolve, reject) => {
      const script = Object.assign(document.createElement("script"), { src: vendor + file, onload: resolve, onerror: reject });
      document.head.append(script);
    });

  let begun = false;
  const begin = async () => {
    if (begun) return;
    begun = true;
    await load("requirejs/require.js");
    window.require.config({
      paths: {
        anywidget: vendor + "anywidget/index",
        // defined inside embed-amd.js; its address says where the icon fonts are
        "@jupyter-widgets/html-manager/dist/libembed-amd": vendor + "html-manager/libembed-amd",
      },
    });
    await load("html-manager/embed-amd.js");
  };

  document.addEventListener("DOMContentLoaded", () => {
    const near = new IntersectionObserver((entries) => entries.some((each) => each.isIntersecting) && begin(), {
      rootMargin: "1500px",
    });
    const views = document.querySelectorAll('script[type="application/vnd.jupyter.widget-view+json"]');
    for (const view of views) near.observe(view.parentElement);
    addEventListener("beforeprint", () => views.length && begin());
    if (location.hash.startsWith("#icp?")) begin(); // a link to a state of the explorer
  });
})();
