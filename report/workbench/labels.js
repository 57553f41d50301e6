// Names for a screen reader what Bokeh's widgets leave without one, wherever in their shadow trees, as widgets come and go.
function label(root, above) {
  for (const host of root.querySelectorAll("*")) {
    const inside = host.shadowRoot
    if (!inside) continue
    const own = host.dataset.label || inside.querySelector(".bk-slider-title")?.firstChild?.textContent
    if (own) name(inside, "input, select, button, .noUi-handle", own)
    if (own || above) name(inside, ".bk-events", own || above)
    name(inside, ".bk-tool-overflow", "more tools")
    const list = inside.querySelector("select[name=add]")
    if (list && !list.dataset.patient) patient(list)
    label(inside, own || above)
  }
}
function name(inside, which, said) {
  for (const part of inside.querySelectorAll(which)) {
    if (part.getAttribute("aria-label") !== said) part.setAttribute("aria-label", said)
    if (which === ".bk-events") part.setAttribute("role", "img")
  }
}
setInterval(() => label(document, ""), 500)

// On a closed list an arrow key chooses at once on most systems: what does something when it is chosen waits for Enter, so that one can look at all of it.
function patient(list) {
  list.dataset.patient = "yes"
  let key = "", waiting = false
  list.addEventListener("pointerdown", () => { key = "" })
  list.addEventListener("blur", () => { if (waiting) list.selectedIndex = 0; waiting = false })
  list.addEventListener("keydown", event => {
    key = event.key
    if (key !== "Enter" || !waiting) return
    event.preventDefault()
    waiting = false
    list.dispatchEvent(new Event("change"))
  })
  list.getRootNode().addEventListener("change", event => {
    if (event.target !== list || !event.isTrusted || key === "" || key === "Enter" || key === " ") return
    event.stopImmediatePropagation()
    waiting = true
  }, true)
}

// Ctrl+Z undoes, Ctrl+Y and Ctrl+Shift+Z do it again, but where text is being typed.
addEventListener("keydown", event => {
  const typed = event.composedPath()[0]
  if (!(event.ctrlKey || event.metaKey) || event.altKey || (typed.tagName === "INPUT" && ["text", "number"].includes(typed.type))) return
  const key = event.key.toLowerCase()
  const wanted = key === "y" || (key === "z" && event.shiftKey) ? "redo" : key === "z" ? "undo" : null
  const model = wanted && window.Bokeh?.documents?.[0]?.get_model_by_name(wanted)
  if (!model) return
  event.preventDefault()
  window.Bokeh.index.get(model)?.el.shadowRoot.querySelector("button")?.click()
})

// Colours of the pictures follow the page's: drawn again when light turns to dark. The map of errors has colours of its own for a dark page.
const dark = matchMedia("(prefers-color-scheme: dark)")
function shade() {
  const map = window.Bokeh?.documents?.[0]?.get_model_by_name("map")
  if (!map) return false
  const [fill, ink] = dark.matches ? ["night", "night_ink"] : ["colour", "ink"]
  for (const { glyph } of map.renderers) {
    const wanted = glyph.type === "Text" ? { text_color: { field: ink } } : { fill_color: { field: fill }, hatch_color: { field: ink } }
    glyph.setv(wanted, { sync: false })
  }
  return true
}
const waiting = setInterval(() => { if (shade()) clearInterval(waiting) }, 50)
dark.addEventListener("change", () => {
  shade()
  for (const doc of window.Bokeh?.documents ?? []) for (const model of doc.roots()) window.Bokeh.index.get(model)?.request_paint?.()
})
// Said when the program behind the page has ended: nothing on it works then.
addEventListener("spindle:lost", () => {
  document.getElementById("lost").hidden = false
  document.getElementById("loading").hidden = true
})
const started = setInterval(() => {
  const doc = window.Bokeh?.documents?.[0]
  const play = doc?.get_model_by_name("play")
  if (!play || !doc.is_idle) return
  clearInterval(started)
  document.body.dataset.ready = "yes"
  if (!matchMedia("(prefers-reduced-motion: reduce)").matches) play.active = true
}, 200)
