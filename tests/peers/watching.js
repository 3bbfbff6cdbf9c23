// Runs in a page before its own scripts: tells when the largest thing was shown, how far things
// shifted, how long the page was deaf, and what textures take on the graphics card.
(() => {
  const seen = { shownMs: 0, shift: 0, deafMs: 0, textureBytes: 0, mostTextureBytes: 0 };
  window.seen = seen;
  const watch = (type, told) =>
    new PerformanceObserver((list) => list.getEntries().forEach(told)).observe({
      type,
      buffered: true,
    });
  watch("largest-contentful-paint", ({ startTime }) => (seen.shownMs = startTime));
  watch("layout-shift", ({ value, hadRecentInput }) => (seen.shift += hadRecentInput ? 0 : value));
  watch("longtask", ({ duration }) => (seen.deafMs = Math.max(seen.deafMs, duration)));

  const sizes = new WeakMap();
  const { texStorage2D, deleteTexture } = WebGL2RenderingContext.prototype;
  WebGL2RenderingContext.prototype.texStorage2D = function (target, levels, format, width, height) {
    texStorage2D.call(this, target, levels, format, width, height);
    const size = width * height * 4 * (levels > 1 ? 4 / 3 : 1);
    sizes.set(this.getParameter(this.TEXTURE_BINDING_2D), size);
    seen.textureBytes += size;
    seen.mostTextureBytes = Math.max(seen.mostTextureBytes, seen.textureBytes);
  };
  WebGL2RenderingContext.prototype.deleteTexture = function (texture) {
    deleteTexture.call(this, texture);
    seen.textureBytes -= sizes.get(texture) ?? 0;
    sizes.delete(texture);
  };
})();
