// What the address asks for: a model, and from where to see it, in glTF's axes.
export function asked() {
  const query = new URLSearchParams(location.search);
  const numbers = (name) => query.get(name).split(",").map(Number);
  return {
    model: query.get("model"),
    eye: numbers("eye"),
    target: numbers("target"),
    upright: Number(query.get("upright")),
  };
}
