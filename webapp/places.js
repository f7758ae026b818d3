// Folders of viser's that are regions and sections of the frame get the words of their markers, `data-fl="region top"`:
// a style that looked for the marker itself (`:has`) would cost tens of milliseconds at every change of the page.
(() => {
  if (window.finlabPlaces) return;
  window.finlabPlaces = true;
  const MARKERS = 'i.fl-region, i.fl-section', DEPTH = 5;

  function tag(marker) {
    if (!marker.matches(MARKERS)) return;
    let folder = marker;
    for (let k = 0; k < DEPTH; k++) folder = folder?.parentElement;
    if (folder?.matches('.mantine-Paper-root')) folder.dataset.fl = marker.className.replaceAll('fl-', '');
  }

  new MutationObserver((changes) => {
    for (const { addedNodes } of changes)
      for (const node of addedNodes)
        if (node.nodeType === Node.ELEMENT_NODE) [node, ...node.querySelectorAll(MARKERS)].forEach(tag);
  }).observe(document.body, { childList: true, subtree: true });
  document.querySelectorAll(MARKERS).forEach(tag);
})();
