// What is typed while the list of commands is still opening belongs into its box, not to the shortcuts of the page.
(() => {
  if (window.finlabEarly) return;
  window.finlabEarly = true;
  const PATIENCE_MS = 3000;
  const BOX = '.mantine-Spotlight-search', ACTION = '.mantine-Spotlight-action';
  const typing = (target) => target.closest?.('input, textarea, [contenteditable=true]');
  const soon = (act) => requestAnimationFrame(() => requestAnimationFrame(act));
  let early = null, until = 0;

  document.addEventListener('focusin', ({ target: box }) => {
    if (!early || !box.matches?.(BOX)) return;
    const keys = early, text = keys.filter((key) => key !== 'Enter').join('');
    early = null;
    if (!text) return;
    Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, 'value').set.call(box, box.value + text);
    box.dispatchEvent(new Event('input', { bubbles: true }));
    if (keys.includes('Enter')) soon(() => document.querySelector(ACTION)?.click());
  });

  window.addEventListener('keydown', (event) => {
    if (typing(event.target)) return;
    const held = event.ctrlKey || event.metaKey || event.altKey;
    if (performance.now() > until) early = null;
    if (event.ctrlKey !== event.metaKey && !event.shiftKey && event.key.toLowerCase() === 'k' && !document.querySelector(BOX)) {
      until = performance.now() + PATIENCE_MS;
      early = [];
    } else if (early && !held && (event.key.length === 1 || event.key === 'Enter' || event.key === 'Backspace')) {
      if (event.key === 'Backspace') early.pop();
      else early.push(event.key);
      event.preventDefault();
      event.stopImmediatePropagation();
    }
  }, { capture: true });
})();
