// The runs that an address names: none for the list, one, or two to be compared.

// What stands in an address as text; null for what cannot be read.
function decoded(word) {
  try {
    return decodeURIComponent(word);
  } catch {
    return null;
  }
}

export function named(hash) {
  const found = /^#\/runs\/([^/]+)$/.exec(hash) ?? /^#\/compare\/([^/]+)\/([^/]+)$/.exec(hash);
  const runs = (found?.slice(1) ?? []).map(decoded);
  return runs.includes(null) ? [] : runs;
}
