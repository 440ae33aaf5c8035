// A family states three things of an edge; one of them is only listed, and one is read of another struct only.
#pragma once

struct LatchEdge {
  int valid = 0;
  int enable = 0;
  int selector = 0;
};

struct LatchDescription {
  std::vector<LatchEdge> edges;
};
