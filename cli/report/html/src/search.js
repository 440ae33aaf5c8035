/// A text fits when it holds each word of `query`; texts in lower case.
export function matcher(query) {
  const words = query.toLowerCase().split(/\s+/).filter(Boolean);
  return (text) => words.every((word) => text.includes(word));
}
