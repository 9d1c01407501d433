// Takes the new page as soon as there is one, and keeps what is folded out and where one has scrolled to.
"use strict";
(async () => {
  let version = document.documentElement.dataset.version;
  const state = document.getElementById("connection");
  for (;;) {
    try {
      const found = await (await fetch("news?version=" + version)).json();
      state.textContent = "";
      if (String(found.version) !== version) {
        const text = await (await fetch("./")).text();
        const page = new DOMParser().parseFromString(text, "text/html");
        const open = [...document.querySelectorAll("details")].map((part) => part.open);
        document.title = page.title;
        document.querySelector("main").replaceWith(page.querySelector("main"));
        document.dispatchEvent(new Event("replaced"));
        document.querySelectorAll("details").forEach((part, i) => { part.open = open[i] || false; });
        version = page.documentElement.dataset.version;
      }
    } catch (error) {
      state.textContent = "idesign watch has ended: what stands here is not followed any more.";
      await new Promise((done) => setTimeout(done, 1000));
    }
  }
})();
