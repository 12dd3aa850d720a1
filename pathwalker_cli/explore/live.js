// Asks the solver behind the page. `answers` takes what comes back; `answer.move` and `answer.save` ask.
const answer = (() => {
  const place = location.pathname.replace(/[^/]*$/, "");
  const socket = new WebSocket(`ws://${location.host}${place}socket`);
  let waiting = null; // settings that are sent with the next frame
  let hear = () => {};
  socket.addEventListener("message", (event) => hear(JSON.parse(event.data)));
  socket.addEventListener("close", () => hear({ kind: "ended", sentence: "PathWalker has ended: this page answers no longer." }));
  const send = (message) => { if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message)); };
  return {
    hear(listener) { hear = listener; },
    move(settings) {
      if (waiting === null) {
        requestAnimationFrame(() => { send({ kind: "move", settings: waiting }); waiting = null; });
      }
      waiting = settings;
    },
    save(name) { send({ kind: "save", name }); },
  };
})();
