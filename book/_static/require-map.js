// Tell require.js where the widgets' files lie: beside this one, at any page depth, also on file://.
(() => {
  const vendor = new URL("vendor/", document.currentScript.src).href;
  window.require.config({
    paths: {
      anywidget: vendor + "anywidget/index",
      // defined inside embed-amd.js; its address says where the icon fonts are
      "@jupyter-widgets/html-manager/dist/libembed-amd": vendor + "html-manager/libembed-amd",
    },
  });
})();
