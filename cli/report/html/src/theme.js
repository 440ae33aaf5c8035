// Colours as the style sheet has them now.
export const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
