// The presenting view (`panels/presenting.py`): entered by a key, or by `?present=1` in the address; Escape leaves it.
(() => {
  if (window.finlabPresenting) return;
  const page = document.documentElement;
  let isAsked = new URL(location.href).searchParams.has('present');
  const leave = () => window.finlabPresses?.tell('present', 'off', '');

  window.finlabPresenting = {
    begin() {
      if (isAsked) window.finlabPresses.tell('present', 'on', '');
      isAsked = false;
    },
    show(on) { page.toggleAttribute('data-present', on); },
  };
  window.addEventListener('keydown', (event) => {
    if (event.key !== 'Escape' || !page.hasAttribute('data-present') || document.querySelector('.fl-ask')) return;
    event.stopPropagation();
    leave();
  }, { capture: true });
})();
