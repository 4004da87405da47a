"use strict";
// The plotting script, unpacked from the page. Browsers that cannot unpack it (older than 2023) keep the static figures.
const plotting = (async () => {
  const packed = Uint8Array.from(atob(document.getElementById("plotting").textContent), (letter) => letter.charCodeAt(0));
  const unpacked = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  const script = document.createElement("script");
  script.textContent = await new Response(unpacked).text();
  document.head.append(script);
})();
