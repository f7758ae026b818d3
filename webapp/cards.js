// Cards over the view: a question with its answers, or the link that shares a design.
(() => {
  function show(title, text, answers, act, link) {
    document.querySelector('.fl-ask')?.remove();
    const card = document.createElement('div');
    card.className = 'fl-ask';
    card.setAttribute('role', 'dialog');
    card.setAttribute('aria-label', title);
    card.innerHTML = '<b></b><p></p><div class="row"></div>';
    card.querySelector('b').textContent = title;
    card.querySelector('p').textContent = text;
    const row = card.querySelector('.row');
    if (link) {
      const box = Object.assign(document.createElement('input'), { readOnly: true, value: link });
      box.setAttribute('aria-label', 'link');
      row.before(box);
    }
    answers.forEach((word, index) => {
      const button = Object.assign(document.createElement('button'), { textContent: word, className: index ? '' : 'primary' });
      button.onclick = () => act(index, button, card);
      row.append(button);
    });
    card.onkeydown = (event) => {
      event.stopPropagation();
      if (event.key === 'Escape') row.lastChild.click();
    };
    document.body.append(card);
    row.firstChild.focus();
  }

  function copy(box) {
    box.select();
    if (navigator.clipboard) return navigator.clipboard.writeText(box.value).then(() => true, () => document.execCommand('copy'));
    return Promise.resolve(document.execCommand('copy'));
  }

  window.finlabCards = {
    ask: (title, text, answers) => show(title, text, answers, (index, _, card) => {
      card.remove();
      window.finlabPresses.tell('answer', String(index), '');
    }),
    share: (title, text, fragment) => show(title, text, ['Copy the link', 'Let others follow', 'Close'], (index, button, card) => {
      if (index) card.remove();
      if (index === 1) window.finlabPresses.tell('let-follow', '', '');
      if (!index) copy(card.querySelector('input')).then((done) => { button.textContent = done ? 'Copied' : 'Press Ctrl+C'; });
      // Without a query viser's page would take what stands behind the # for a part of its server's name.
    }, `${location.origin}${location.pathname}?shared#${fragment}`),
    follow: (title, text, code) => show(title, text, ['Copy the link', 'Close'], (index, button, card) => {
      if (index) card.remove();
      else copy(card.querySelector('input')).then((done) => { button.textContent = done ? 'Copied' : 'Press Ctrl+C'; });
    }, `${location.origin}${location.pathname}?follow=${code}`),
  };
})();
