/** How the film's texts look: in parts of the picture's height, so that every size shows the same. */

export const LOOK = `
#tour.film { bottom: 2px; cursor: none; }
.film-mark { position: fixed; inset: auto 0 0; height: 2px; }
#tour.film canvas { outline: none; cursor: none; }
.film-over { position: absolute; inset: 0; font-family: var(--sans); font-size: 2.6vh; line-height: 1.4; }
.film-over > * { position: absolute; }
.film-dark { inset: 0; background: #0f1114; }
.film-title, .film-credits { inset: 0; display: grid; place-content: center; justify-items: center; gap: 1.6vh; padding: 0 14%; text-align: center; }
.film-title h1 { margin: 0; font-size: 8vh; text-shadow: 0 0 3vh rgb(0 0 0 / 60%); }
.film-title img { max-height: 11vh; }
.film-title::after, .film-credits h2::after { content: ""; display: block; width: 9vh; height: 0.3vh; margin: 1.4vh auto 0; background: var(--accent-dark); }
.film-name { inset-inline-start: 5.5%; bottom: 17vh; margin: 0; padding-inline-start: 1.8vh; border-inline-start: 0.4vh solid var(--accent-dark); font: 500 4.6vh/1.25 var(--serif); text-shadow: 0 0 0.4vh rgb(0 0 0 / 80%), 0 0 2.4vh rgb(0 0 0 / 75%); }
.film-caption { inset-inline: 8%; bottom: 5vh; margin: 0; text-align: center; white-space: pre-line; }
.film-caption span { padding: 0.5vh 1.4vh; background: rgb(10 11 13 / 78%); box-decoration-break: clone; -webkit-box-decoration-break: clone; font-size: 3.1vh; line-height: 1.62; }
.film-credits h2 { margin: 0 0 1vh; font-size: 5vh; }
.film-credits p { margin: 0.4vh 0; }
.film-credits a { color: inherit; text-decoration: none; }
.film-credits .prose { font-size: inherit; }
.film-credits .small { color: var(--ink-soft); font-size: 2.2vh; }
`;
