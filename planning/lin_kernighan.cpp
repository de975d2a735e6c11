#include "planning/lin_kernighan.hpp"

#include <algorithm>
#include <array>
#include <numeric>

namespace planning {
namespace {

constexpr int kNeighbours = 10;
constexpr int kDepthMax = 6;
constexpr std::array<int, 3> kBreadth = {5, 3,
                                         1};  // Of the steps by depth; the last from there on.
constexpr double kGainMin = 1e-9;
constexpr int kKickSpan = 50;  // A kick swaps two neighbouring runs this long together at most.
constexpr int kSegmentMax = 3;
constexpr int kStartsMax = 120;

using Order = std::vector<int>;

std::size_t at(int i) {
  return static_cast<std::size_t>(i);
}

Order nearest_neighbour(const SymmetricCosts& cost, int start) {
  Order order{start};
  std::vector<char> used(at(cost.n), 0);
  used[at(start)] = 1;
  while (static_cast<int>(order.size()) < cost.n) {
    int nearest = -1;
    for (int j = 0; j < cost.n; ++j)
      if (!used[at(j)] && (nearest < 0 || cost(order.back(), j) < cost(order.back(), nearest)))
        nearest = j;
    used[at(nearest)] = 1;
    order.push_back(nearest);
  }
  return order;
}

class Search {
 public:
  explicit Search(const SymmetricCosts& cost)
      : cost_(cost), n_(cost.n), width_(std::min(kNeighbours, cost.n - 1)), place_(at(cost.n)) {
    Order others(at(n_));
    for (int i = 0; i < n_; ++i) {
      std::iota(others.begin(), others.end(), 0);
      others.erase(others.begin() + i);
      std::stable_sort(others.begin(), others.end(),
                       [&](int a, int b) { return cost(i, a) < cost(i, b); });
      near_.insert(near_.end(), others.begin(), others.begin() + width_);
      others.resize(at(n_));
    }
    waiting_.assign(at(n_), 0);
  }

  void set(const Order& order) {
    order_ = order;
    for (int i = 0; i < n_; ++i) place_[at(order_[at(i)])] = i;
    undo_.clear();
  }

  const Order& order() const { return order_; }

  double total() const {
    double sum = 0;
    for (int i = 0; i < n_; ++i) sum += cost_(order_[at(i)], order_[at((i + 1) % n_)]);
    return sum;
  }

  // Improves until nothing more is found. Returns what was gained.
  double improve_all() {
    for (int i = 0; i < n_; ++i) wait(i);
    return improve();
  }

  // One perturbation and repair; taken back unless the tour gets no longer.
  void kick(std::mt19937_64& random) {
    undo_.clear();
    const double gain = double_bridge(random) + improve();
    if (gain >= -kGainMin) return;
    for (; !undo_.empty(); undo_.pop_back()) reverse(undo_.back().first, undo_.back().second);
  }

 private:
  int next(int node) const {
    const int i = place_[at(node)] + 1;
    return order_[at(i == n_ ? 0 : i)];
  }
  int previous(int node) const {
    const int i = place_[at(node)];
    return order_[at(i == 0 ? n_ - 1 : i - 1)];
  }

  // Turns round `count` places from `first` on.
  void reverse(int first, int count) {
    int i = first;
    int j = first + count - 1;
    if (j >= n_) j -= n_;
    for (int k = count / 2; k > 0; --k) {
      std::swap(order_[at(i)], order_[at(j)]);
      place_[at(order_[at(i)])] = i;
      place_[at(order_[at(j)])] = j;
      if (++i == n_) i = 0;
      if (--j < 0) j = n_ - 1;
    }
  }

  // Turns round the run from node a on to node b, or all the rest, which is the same tour.
  void flip(int a, int b) {
    int first = place_[at(a)];
    int count = place_[at(b)] - first;
    if (count < 0) count += n_;
    ++count;
    if (2 * count > n_) {
      first = (first + count) % n_;
      count = n_ - count;
    }
    reverse(first, count);
    undo_.emplace_back(first, count);
  }

  void take_back(std::size_t flips) {
    for (; undo_.size() > flips; undo_.pop_back()) reverse(undo_.back().first, undo_.back().second);
  }

  void wait(int node) {
    if (waiting_[at(node)]) return;
    waiting_[at(node)] = 1;
    queue_.push_back(node);
  }

  double improve() {
    double gained = 0;
    for (std::size_t head = 0; head < queue_.size(); ++head) {
      const int node = queue_[head];
      waiting_[at(node)] = 0;
      for (double gain = 1; gain > 0;) {
        gain = improve_from(node);
        gained += gain;
      }
    }
    queue_.clear();
    return gained;
  }

  double improve_from(int node) {
    for (const int other : {next(node), previous(node)}) {
      chain_ = {node, other};
      const double gain = step(0, node, other, cost_(node, other));
      if (gain <= 0) continue;
      for (const int changed : chain_) wait(changed);
      return gain;
    }
    return move_segment(node);
  }

  struct Choice {
    double open_gain;  // With the tour left open between `end` and the base.
    int to, end;
  };

  // One step of Lin and Kernighan: the tour has been opened between base and end, with `open_gain`
  // won so far. Joins the end to a near node, opens the tour beside that and closes it there if
  // that pays; else goes deeper.
  double step(int depth, int base, int end, double open_gain) {
    std::array<Choice, kNeighbours> choices;
    const int count = choose(base, end, open_gain, choices);
    const int breadth = kBreadth[std::min(at(depth), kBreadth.size() - 1)];
    for (int k = 0; k < std::min(count, breadth); ++k) {
      const Choice& c = choices[at(k)];
      const std::size_t flips = undo_.size();
      if (next(base) == end)
        flip(end, c.end);
      else
        flip(c.end, end);
      chain_.push_back(c.to);
      chain_.push_back(c.end);
      const double gain = c.open_gain - cost_(c.end, base);
      if (gain > kGainMin) return gain;
      if (depth + 1 < kDepthMax) {
        const double deeper = step(depth + 1, base, c.end, c.open_gain);
        if (deeper > 0) return deeper;
      }
      chain_.resize(chain_.size() - 2);
      take_back(flips);
    }
    return 0;
  }

  int choose(int base, int end, double open_gain, std::array<Choice, kNeighbours>& choices) const {
    const bool forward = next(base) == end;
    int count = 0;
    for (int k = 0; k < width_; ++k) {
      const int to = near_[at(end * width_ + k)];
      const double joined = open_gain - cost_(end, to);
      if (joined <= kGainMin) break;
      const int opened = forward ? previous(to) : next(to);
      if (to == base || opened == end || was_added(to, opened)) continue;
      choices[at(count++)] = {joined + cost_(to, opened), to, opened};
    }
    std::stable_sort(choices.begin(), choices.begin() + count,
                     [](const Choice& a, const Choice& b) { return a.open_gain > b.open_gain; });
    return count;
  }

  // chain_ is base, end, to, end, to, end, ...: each `to` was joined to the end before it.
  bool was_added(int a, int b) const {
    for (std::size_t i = 1; i + 1 < chain_.size(); i += 2)
      if ((chain_[i] == a && chain_[i + 1] == b) || (chain_[i] == b && chain_[i + 1] == a))
        return true;
    return false;
  }

  // Or-opt: a run of up to three nodes that begins at `node` moves next to a node near its end.
  double move_segment(int node) {
    for (const bool forward : {true, false}) {
      int last = node;
      for (int length = 1; length <= std::min(kSegmentMax, n_ - 3); ++length) {
        if (length > 1) last = forward ? next(last) : previous(last);
        const int first = forward ? node : last;
        const int end = forward ? last : node;
        const double gain = move_run(first, end, node);
        if (gain > 0) return gain;
      }
    }
    return 0;
  }

  bool in_run(int first, int length, int node) const {
    int offset = place_[at(node)] - place_[at(first)];
    if (offset < 0) offset += n_;
    return offset < length;
  }

  // The run first .. end (in tour order); `joined`, one of its two ends, gets the new neighbour.
  double move_run(int first, int end, int joined) {
    const int before = previous(first);
    const int after = next(end);
    int length = place_[at(end)] - place_[at(first)];
    if (length < 0) length += n_;
    ++length;
    const int other = joined == first ? end : first;
    const double freed = cost_(before, first) + cost_(end, after) - cost_(before, after);
    for (int k = 0; k < width_; ++k) {
      const int to = near_[at(joined * width_ + k)];
      if (freed - cost_(joined, to) <= kGainMin) break;
      if (in_run(first, length, to)) continue;
      for (const int beyond : {next(to), previous(to)}) {
        if (in_run(first, length, beyond)) continue;
        const double gain = freed - cost_(joined, to) - cost_(other, beyond) + cost_(to, beyond);
        if (gain <= kGainMin) continue;
        for (const int changed : {before, first, end, after, to, beyond}) wait(changed);
        insert_run(first, end, to, beyond, joined);
        return gain;
      }
    }
    return 0;
  }

  // Takes the run out and puts it between `to` and `beyond`, `joined` next to `to`.
  //   before [first .. end] [after .. left] right
  //   before [left .. after] [end .. first] right     the whole turned round
  //   before [after .. left] [end .. first] right     the middle turned back
  //   before [after .. left] [first .. end] right     the run turned back, if so wanted
  void insert_run(int first, int end, int to, int beyond, int joined) {
    const int after = next(end);
    const int left = next(to) == beyond ? to : beyond;
    flip(first, left);
    flip_run(after, left, end);
    if (next(to) != joined && previous(to) != joined) flip_run(end, first, left);
  }

  // Turns round the run with the ends a and b; `outside` is a's neighbour that is not in it.
  void flip_run(int a, int b, int outside) {
    if (a == b) return;
    if (previous(a) == outside)
      flip(a, b);
    else
      flip(b, a);
  }

  double double_bridge(std::mt19937_64& random) {
    const auto below = [&](int count) { return static_cast<int>(random() % at(count)); };
    const int span = std::min(kKickSpan, n_ - 2);
    const int first = below(n_);
    const int length = 2 + below(span - 1);
    const int cut = 1 + below(length - 1);
    const auto node = [&](int offset) { return order_[at((first + offset) % n_)]; };
    const int a0 = node(0), a1 = node(cut - 1), b0 = node(cut), b1 = node(length - 1);
    const int before = previous(a0), after = next(b1);
    const double gain = cost_(before, a0) + cost_(a1, b0) + cost_(b1, after) - cost_(before, b0) -
                        cost_(b1, a0) - cost_(a1, after);
    const auto turn = [&](int from, int count) {
      reverse(from % n_, count);
      undo_.emplace_back(from % n_, count);
    };
    turn(first, length);
    turn(first, length - cut);
    turn(first + length - cut, cut);
    for (const int changed : {before, a0, a1, b0, b1, after}) wait(changed);
    return gain;
  }

  const SymmetricCosts& cost_;
  const int n_;
  const int width_;
  std::vector<int> near_;  // The width_ nearest nodes of each, nearest first.
  Order order_;
  std::vector<int> place_;
  std::vector<std::pair<int, int>> undo_;  // Reversals made: first place, count.
  std::vector<int> chain_;
  std::vector<int> queue_;
  std::vector<char> waiting_;
};

}  // namespace

std::vector<int> lin_kernighan(const SymmetricCosts& cost, int kicks_per_node, std::uint64_t seed) {
  Search search(cost);
  Order best;
  double least = 0;
  const int starts = std::min(cost.n, kStartsMax);
  for (int k = 0; k < starts; ++k) {
    search.set(nearest_neighbour(cost, k * cost.n / starts));
    search.improve_all();
    const double total = search.total();
    if (!best.empty() && total >= least - kGainMin) continue;
    least = total;
    best = search.order();
  }
  search.set(best);
  std::mt19937_64 random(seed);
  for (long kick = 0; kick < static_cast<long>(kicks_per_node) * cost.n; ++kick)
    search.kick(random);
  return search.order();
}

}  // namespace planning
