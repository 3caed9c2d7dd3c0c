// Moves the boundary between two pictures; the space bar changes from one to the other.
for (const box of document.querySelectorAll('.ab')) {
    const input = box.querySelector('input');
    const show = () => {
        box.style.setProperty('--at', input.value + '%');
        input.setAttribute('aria-valuetext', input.value + ' % this run');
    };
    input.addEventListener('input', show);
    input.addEventListener('keydown', (event) => {
        if (event.key !== ' ') return;
        event.preventDefault();
        input.value = input.value > 50 ? 0 : 100;
        show();
    });
    show();
}
