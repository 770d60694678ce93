// A file dropped on the page: the browser would leave the live view for it. It says what to do with it instead.
import { listen, tell } from "/page/bus.js";

const VIDEOS = /^(video|image)\//, ENDINGS = /\.(mp4|mkv|avi|mov|ts|webm|m4v|mjpe?g|png|jpe?g|tiff?|bmp)$/i;
const holdsFiles = (event) => [...event.dataTransfer.types].includes("Files");

function words(file) {
  const name = file.name || "What was dropped";
  if (/\.toml$/i.test(name)) return `${name}: type its path under Set-up, Load settings.`;
  if (!VIDEOS.test(file.type) && !ENDINGS.test(name)) return `${name} is neither a video nor a picture that can be measured.`;
  return `${name} cannot be opened here, because a browser does not say where a file lies. In a terminal: fingervision live "${name}"`;
}
listen("start", () => {
  document.addEventListener("dragover", (event) => { if (holdsFiles(event)) event.preventDefault(); });
  document.addEventListener("drop", (event) => {
    if (!holdsFiles(event)) return;
    event.preventDefault();
    for (const file of [...event.dataTransfer.files].slice(0, 5)) tell("message", words(file), "dropped");
  });
});
