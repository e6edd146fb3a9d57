// What all widgets share. A widget takes the place of a figure on the screen; on paper, and if it fails, the figure stays.
const content = JSON.parse(document.getElementById("content").textContent);

function make(tag, attributes = {}, ...children) {
  const svg = ["svg", "rect", "line", "circle", "text"].includes(tag);
  const element = svg ? document.createElementNS("http://www.w3.org/2000/svg", tag) : document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value !== null && value !== undefined) element.setAttribute(name, value);
  }
  element.append(...children.flat());
  return element;
}

function widget(figure, build) {
  const place = document.getElementById(`figure-${figure}`);
  if (!place) return;
  const box = make("div", { class: "widget" });
  place.prepend(box);
  try {
    box.append(...(build(box) ?? []));
    place.classList.add("live");
    place.parentElement.hidden = false;
  } catch (error) {
    box.remove();
    console.error(error);
  }
}

// Numbers that were packed as unsigned integers; the largest code stands for none.
function unpack({ low, step, kind, codes }) {
  const bytes = Uint8Array.from(atob(codes), (letter) => letter.charCodeAt(0));
  const whole = kind === "u4" ? new Uint32Array(bytes.buffer) : new Uint16Array(bytes.buffer);
  const none = kind === "u4" ? 4294967295 : 65535;
  return Array.from(whole, (code) => (code === none ? null : low + step * code));
}

function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}

// A number to the second digit of a scale, as a person would round it.
function rounded(value, scale) {
  if (!(scale > 0) || value === 0) return String(Number(value.toPrecision(4)));
  const places = 1 - Math.floor(Math.log10(scale));
  if (places > 7 || Math.abs(value) >= 1e6) {
    return value.toExponential(Math.min(20, Math.max(0, places + Math.floor(Math.log10(Math.abs(value)))))).replaceAll("-", "\u2212");
  }
  return value.toFixed(Math.max(0, places)).replace("-", "\u2212");
}

const signed = (value) => (value < 0 ? "\u2212" : "+") + Math.abs(value).toFixed(2);

// One line beside the pointer.
const tip = make("div", { class: "tip", hidden: "" });
document.body.append(tip);
function point(event, words) {
  tip.hidden = !words;
  if (!words) return;
  tip.textContent = words;
  const left = Math.min(event.clientX + 12, document.documentElement.clientWidth - tip.offsetWidth - 4);
  tip.style.left = `${Math.max(4, left)}px`;
  tip.style.top = `${event.clientY + 16 + tip.offsetHeight > innerHeight ? event.clientY - tip.offsetHeight - 8 : event.clientY + 16}px`;
}

function legend(entries) {
  return make("p", { class: "legend" }, entries.map(([name, words]) => make("span", {}, make("i", { class: name }), words)));
}
