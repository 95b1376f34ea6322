#include "support/catch.hpp"
#include <gravel/contact/impact_queue.hpp>
#include <gravel/contact/late_pairs.hpp>

// What blows leave to be looked at is no more than there is to come.

using namespace gravel;
using namespace gravel::detail;

// Seen to fail: none was left out before its turn, 10 000.
TEST_CASE("Of events that blows made void no more wait than there are others, or a few hundred") {
  ImpactHistories<double> histories;
  histories.resize(11);
  ImpactQueue<double> queue;
  const std::vector<std::vector<ImpactEvent<double>>> none;
  queue.fill(none);
  for (std::uint32_t blow = 0; blow < 1000; ++blow) {
    ++histories.at(0).impacts;
    for (std::uint32_t other = 1; other <= 10; ++other) {
      queue.push({1.0 / (blow + other), 0, other, 0, other}, histories);
    }
  }
  std::size_t waiting = 0, valid = 0;
  double last = 0;
  while (!queue.empty()) {
    const ImpactEvent<double> event = queue.pop();
    CHECK(event.t >= last);
    last = event.t;
    ++waiting;
    valid += queue.isVoid(event, histories) ? 0U : 1U;
  }
  CHECK(valid == 10);
  CHECK(waiting <= 1000);
}

// Seen to fail: each time a body was sent elsewhere its pairs were added again.
TEST_CASE(
    "A pair that a blow brings is taken once, however often its bodies are struck, and none of the list") {
  const std::vector<Pair> list{{0, 1}, {0, 2}, {1, 3}};
  PairsOfBodies known;
  known.find(5, list);
  LatePairs late;
  const std::vector<Pair> of0{{0, 1}, {0, 3}, {0, 4}};
  const std::vector<Pair> of3{{0, 3}, {1, 3}, {2, 3}};
  const auto add = [&](std::uint32_t body, const std::vector<Pair>& found) {
    late.add(body, list, known, [&](std::vector<Pair>& out) { out = found; });
  };
  for (int k = 0; k < 3; ++k) {
    add(0, of0);
    add(3, of3);
  }
  CHECK(late.all() == std::vector<Pair>{{0, 3}, {0, 4}, {2, 3}});
  std::vector<Pair> ofThree;
  late.each(3, [&](const Pair& pair) { ofThree.push_back(pair); });
  CHECK(ofThree == std::vector<Pair>{{2, 3}, {0, 3}});
  late.clear();
  late.each(3, [&](const Pair&) { FAIL(); });
  add(0, {});
  CHECK(late.all().empty());
}
