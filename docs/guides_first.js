// How the site's search ranks: as Sphinx does, but what a guide says comes before names of functions.
var Scorer = {
  score: ([page, title, anchor, description, score]) =>
    /^docs\/(api|api_rooms|parameters)$/.test(page) ? score - 20 : score,
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};
