// LDL^T factors of the symmetric indefinite matrices of one optimal control problem, which follow
// each other in an interior-point method with the same pattern.
//
// Multifrontal: the caller says in which order groups of unknowns are eliminated (the points of an
// interval, the interval, its node, ...), so every front is small, dense and known beforehand.
// Within a front, pivots of order 1 and 2 are chosen for stability among neighbouring columns; a
// column without an acceptable pivot is handed on to the next front.
//
// IPOPT loads linear solvers by the names of their routines; this one answers to those of MA57.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <memory>
#include <numeric>
#include <vector>

#define EXPORT extern "C" __attribute__((visibility("default")))

namespace {

using std::vector;

// One tile of a matrix product: kTileRows vectors of kWidth numbers high, kTileColumns wide.
#if defined(__AVX512F__)
constexpr int kWidth = 8, kTileColumns = 8;
#elif defined(__AVX__)
constexpr int kWidth = 4, kTileColumns = 4;
#else
constexpr int kWidth = 2, kTileColumns = 4;
#endif
constexpr int kTileRows = 2, kTileHeight = kTileRows * kWidth;
constexpr int kPanel = 16;           // columns among which a pivot is looked for
constexpr double kGoodPivot = 0.1;   // of the largest entry in its column: taken without a look further
constexpr double kZero = 1e-20;      // no pivot is smaller
constexpr int kMostDelayed = 100;    // columns without a pivot in one front: the matrix is singular

typedef double Vector __attribute__((vector_size(8 * kWidth), aligned(8), may_alias));

// A dense symmetric matrix of which the first columns, the candidates, are to be eliminated; lower
// triangle, by columns.  Candidates stay as factors, the rest goes into the next front.
struct Front {
  int size = 0, stride = 0, candidates = 0;
  double *first = nullptr, *rest = nullptr;

  double* column(int k) const {
    return k < candidates ? first + std::size_t(k) * stride
                          : rest + std::size_t(k - candidates) * stride;
  }
  double& at(int row, int k) const { return column(k)[row]; }
};

int padded(int rows) { return (rows + kTileHeight - 1) / kTileHeight * kTileHeight; }

// C(rows, kColumns) -= A(rows, depth) B(depth, kColumns), rows a multiple of kTileHeight.
template <int kColumns>
void multiply(int rows, int depth, const double* a, int stride_a, const double* b, double* c,
              int stride_c) {
  for (int row = 0; row < rows; row += kTileHeight) {
    Vector sum[kTileRows][kColumns] = {};
    for (int k = 0; k < depth; ++k) {
      const double* left = a + row + std::size_t(k) * stride_a;
      Vector part[kTileRows];
      for (int i = 0; i < kTileRows; ++i)
        part[i] = *reinterpret_cast<const Vector*>(left + i * kWidth);
      for (int j = 0; j < kColumns; ++j)
        for (int i = 0; i < kTileRows; ++i) sum[i][j] += part[i] * b[k * kColumns + j];
    }
    for (int j = 0; j < kColumns; ++j)
      for (int i = 0; i < kTileRows; ++i)
        *reinterpret_cast<Vector*>(c + row + i * kWidth + std::size_t(j) * stride_c) -= sum[i][j];
  }
}

// Pivots: block diagonal D with blocks of order 1 and 2.
struct Pivots {
  vector<double> diagonal, below;  // below(k) is not 0 where a block of order 2 begins at k
};

class Elimination {
 public:
  Elimination(Front& front, int* index, Pivots& pivots, double threshold)
      : f_(front), index_(index), pivots_(pivots), threshold_(threshold) {}

  // Eliminate the first `candidates` columns but those without an acceptable pivot, which end up
  // behind the others; return how many are eliminated.
  int run(int candidates) {
    pivots_.diagonal.assign(candidates, 0.0);
    pivots_.below.assign(candidates, 0.0);
    int done = 0, last = candidates;  // candidates from `last` on are put off
    bool progress = false;
    while (done < last) {
      const int begin = done, end = std::min(done + kPanel, last);
      done = panel(begin, end);
      update(begin, done, end, candidates);
      progress = progress || done > begin;
      if (done < end) {
        const int failed = end - done, others = std::min(failed, last - end);
        for (int i = 0; i < others; ++i) swap(done + i, last - 1 - i);
        last -= failed;
      }
      if (done == last && last < candidates && progress) {
        last = candidates;
        progress = false;
      }
    }
    update(0, done, candidates, f_.size);
    return done;
  }

  int negative = 0;

 private:
  // Eliminate columns [begin, end) among themselves; return where the eliminated ones end.
  int panel(int begin, int end) {
    int k = begin;
    while (k < end) {
      int order = 0;
      for (int candidate = k; candidate < end && !order; ++candidate)
        order = choose(k, candidate, end);
      if (!order) return k;
      if (order == 1)
        eliminate_one(k, end);
      else
        eliminate_two(k, end);
      k += order;
    }
    return k;
  }

  // Largest entry of a column among rows from k on, without the diagonal and row `but`.
  double largest(int k, int column, int but) {
    double most = 0;
    for (int c = k; c < column; ++c)
      if (c != but) most = std::max(most, std::fabs(f_.at(column, c)));
    const double* entries = f_.column(column);
    double parts[8] = {};
    int r = column + 1;
    const double held = but > column ? entries[but] : 0;
    if (but > column) f_.column(column)[but] = 0;
    for (; r + 8 <= f_.size; r += 8)
      for (int i = 0; i < 8; ++i) {
        const double size = std::fabs(entries[r + i]);
        parts[i] = parts[i] > size ? parts[i] : size;
      }
    for (; r < f_.size; ++r) most = std::max(most, std::fabs(entries[r]));
    if (but > column) f_.column(column)[but] = held;
    for (double part : parts) most = std::max(most, part);
    return most;
  }

  double entry(int a, int b) { return a > b ? f_.at(a, b) : f_.at(b, a); }

  // Bring a pivot with this candidate to place k; return its order, 0 where none is acceptable.
  int choose(int k, int candidate, int end) {
    const double diagonal = std::fabs(f_.at(candidate, candidate));
    const double column = largest(k, candidate, -1);
    if (diagonal > kZero && diagonal >= kGoodPivot * column) return one(k, candidate);
    int partner = -1;
    double best = kZero;
    for (int c = k; c < end; ++c) {
      if (c == candidate) continue;
      const double size = std::fabs(entry(c, candidate));
      if (size > best) best = size, partner = c;
    }
    if (partner >= 0 && acceptable(k, candidate, partner)) return two(k, candidate, partner);
    if (diagonal > kZero && diagonal >= threshold_ * column) return one(k, candidate);
    return 0;
  }

  bool acceptable(int k, int a, int b) {
    const double aa = f_.at(a, a), bb = f_.at(b, b), ab = entry(a, b);
    const double determinant = std::fabs(aa * bb - ab * ab);
    if (determinant <= kZero * std::fabs(ab) || determinant < 1e-8 * ab * ab) return false;
    const double in_a = largest(k, a, b), in_b = largest(k, b, a);
    const double limit = determinant / threshold_;
    return std::fabs(bb) * in_a + std::fabs(ab) * in_b <= limit &&
           std::fabs(ab) * in_a + std::fabs(aa) * in_b <= limit;
  }

  int one(int k, int candidate) {
    swap(k, candidate);
    return 1;
  }

  int two(int k, int a, int b) {
    swap(k, a);
    if (b == k) b = a;
    swap(k + 1, b);
    return 2;
  }

  // Exchange rows and columns i and j, in the eliminated columns too.
  void swap(int i, int j) {
    if (i == j) return;
    if (i > j) std::swap(i, j);
    std::swap(index_[i], index_[j]);
    for (int c = 0; c < i; ++c) std::swap(f_.at(i, c), f_.at(j, c));
    std::swap(f_.at(i, i), f_.at(j, j));
    for (int c = i + 1; c < j; ++c) std::swap(f_.at(c, i), f_.at(j, c));
    double *a = f_.column(i), *b = f_.column(j);
    std::swap_ranges(a + j + 1, a + f_.size, b + j + 1);
  }

  void eliminate_one(int k, int end) {
    double* l = f_.column(k);
    const double pivot = l[k], inverse = 1 / pivot;
    pivots_.diagonal[k] = pivot;
    negative += pivot < 0;
    for (int c = k + 1; c < end; ++c) subtract(f_.column(c), l, l[c] * inverse, c);
    for (int r = k + 1; r < f_.size; ++r) l[r] *= inverse;
  }

  void eliminate_two(int k, int end) {
    double *__restrict l = f_.column(k), *__restrict m = f_.column(k + 1);
    const double a = l[k], b = l[k + 1], c = m[k + 1], determinant = a * c - b * b;
    pivots_.diagonal[k] = a;
    pivots_.below[k] = b;
    pivots_.diagonal[k + 1] = c;
    negative += determinant < 0 ? 1 : (a < 0 ? 2 : 0);
    const double ia = c / determinant, ib = -b / determinant, ic = a / determinant;
    for (int column = k + 2; column < end; ++column) {
      const double s = ia * l[column] + ib * m[column], t = ib * l[column] + ic * m[column];
      double* __restrict to = f_.column(column);
      for (int r = column; r < f_.size; ++r) to[r] -= l[r] * s + m[r] * t;
    }
    for (int r = k + 2; r < f_.size; ++r) {
      const double first = l[r], second = m[r];
      l[r] = ia * first + ib * second;
      m[r] = ib * first + ic * second;
    }
    l[k + 1] = 0;
  }

  void subtract(double* __restrict to, const double* __restrict from, double factor, int begin) {
    for (int r = begin; r < f_.size; ++r) to[r] -= from[r] * factor;
  }

  // F(., [from, to)) -= L(., [begin, end)) D L^T, in the lower triangle.
  void update(int begin, int end, int from, int to) {
    const int depth = end - begin;
    if (depth <= 0 || from >= to) return;
    packed_.resize(std::size_t(depth) * kTileColumns);
    int c = from;
    for (; c + kTileColumns <= to; c += kTileColumns) tile<kTileColumns>(begin, depth, c);
    for (; c < to; ++c) tile<1>(begin, depth, c);
  }

  template <int kColumns>
  void tile(int begin, int depth, int c) {
    pack<kColumns>(begin, begin + depth, c);
    const int top = c / kTileHeight * kTileHeight;  // what lies above the diagonal is never read
    multiply<kColumns>(f_.stride - top, depth, f_.column(begin) + top, f_.stride, packed_.data(),
                       f_.column(c) + top, f_.stride);
  }

  // Columns [c, c + kColumns) of D L^T, rows [begin, end).
  template <int kColumns>
  void pack(int begin, int end, int c) {
    double* to = packed_.data();
    for (int k = begin; k < end; ++k, to += kColumns) {
      const double* l = f_.column(k) + c;
      const double a = pivots_.diagonal[k], b = pivots_.below[k];
      if (b == 0) {
        for (int j = 0; j < kColumns; ++j) to[j] = a * l[j];
        continue;
      }
      const double *m = f_.column(++k) + c, d = pivots_.diagonal[k];
      for (int j = 0; j < kColumns; ++j) to[j] = a * l[j] + b * m[j];
      to += kColumns;
      for (int j = 0; j < kColumns; ++j) to[j] = b * l[j] + d * m[j];
    }
  }

  Front& f_;
  int* index_;
  Pivots& pivots_;
  double threshold_;
  vector<double> packed_;
};

// What is kept of a front for the solves: L, D and which unknowns its rows are.
struct Factor {
  int pivots = 0, stride = 0;
  vector<int> index;
  vector<double> lower;  // stride x pivots at least, by columns
  Pivots d;
};

struct Group {
  int begin = 0, end = 0;         // places in the order of elimination
  vector<int> border;             // unknowns of later groups that its front touches
  vector<int> children;
  vector<int> entries;            // entries of the matrix that enter here
  vector<int> rows;               // inequality rows that enter here
};

// A slack and its row: eliminated beforehand, since a slack occurs in its row alone.
struct SlackRow {
  int slack, row;
  vector<int> slack_entries, coupling_entries, row_entries;  // of the 2 x 2 pivot
  vector<int> unknowns, unknown_entries;                     // the rest of the row
  double inverse_ss = 0, inverse_sr = 0, inverse_rr = 0;
  vector<double> values;
};

class StageLdl {
 public:
  // order: all unknowns in the order of elimination; ends: where each group of them ends.
  StageLdl(int size, vector<int> order, const vector<int>& ends)
      : n_(size), order_(std::move(order)), ends_(ends) {}

  int size() const { return n_; }
  int negative() const { return negative_; }
  int delayed() const { return delayed_; }
  double operations() const { return operations_; }
  int count() const { return count_; }
  int entries() const { return int(rows_.size()); }
  const int* rows() const { return rows_.data(); }
  const int* columns() const { return columns_.data(); }

  bool analysed(int n, int entries, const int* rows, const int* columns) {
    if (n != n_) return false;
    if (std::size_t(entries) == rows_.size() && std::equal(rows_.begin(), rows_.end(), rows) &&
        std::equal(columns_.begin(), columns_.end(), columns))
      return true;
    rows_.assign(rows, rows + entries);
    columns_.assign(columns, columns + entries);
    analyse();
    return true;
  }

  // Factorise; false where the matrix is singular, or so nearly that most columns lack a pivot.
  bool factorise(const double* values, double threshold) {
    negative_ = delayed_ = 0;
    ++count_;
    operations_ = 0;
    for (auto& row : slack_rows_)
      if (!eliminate(row, values)) return false;
    position_.assign(n_, -1);
    updates_.assign(groups_.size(), Update());
    bool regular = true;
    for (std::size_t g = 0; g < groups_.size() && regular; ++g)
      regular = factorise(int(g), values, threshold);
    pool_.clear();
    updates_.clear();
    return regular;
  }

  void solve(double* x) {
    for (auto& s : slack_rows_) {
      const double a = x[s.slack], b = x[s.row];
      x[s.slack] = s.inverse_ss * a + s.inverse_sr * b;
      x[s.row] = s.inverse_sr * a + s.inverse_rr * b;
      for (std::size_t i = 0; i < s.unknowns.size(); ++i) x[s.unknowns[i]] -= s.values[i] * x[s.row];
    }
    for (auto& factor : factors_) forward(factor, x);
    for (auto factor = factors_.rbegin(); factor != factors_.rend(); ++factor) backward(*factor, x);
    for (auto& s : slack_rows_) {
      double sum = 0;
      for (std::size_t i = 0; i < s.unknowns.size(); ++i) sum += s.values[i] * x[s.unknowns[i]];
      x[s.slack] -= s.inverse_sr * sum;
      x[s.row] -= s.inverse_rr * sum;
    }
  }

 private:
  struct Update {
    Front front;
    vector<double> memory;
  };

  void analyse() {
    find_slack_rows();
    groups_.clear();
    group_of_.assign(n_, -1);
    rank_.assign(n_, 0);
    std::size_t at = 0;
    pivot_order_.clear();
    for (int end : ends_) {
      Group group;
      group.begin = int(pivot_order_.size());
      for (; at < std::size_t(end); ++at) {
        if (in_slack_row_[order_[at]] >= 0) continue;
        group_of_[order_[at]] = int(groups_.size());
        rank_[order_[at]] = int(pivot_order_.size());
        pivot_order_.push_back(order_[at]);
      }
      group.end = int(pivot_order_.size());
      if (group.end > group.begin) groups_.push_back(group);
    }
    for (std::size_t e = 0; e < rows_.size(); ++e) {
      const int i = rows_[e] - 1, j = columns_[e] - 1;
      if (in_slack_row_[i] >= 0 || in_slack_row_[j] >= 0) continue;
      const int g = std::min(group_of_[i], group_of_[j]);
      groups_[g].entries.push_back(int(e));
      groups_[g].border.push_back(group_of_[i] > group_of_[j] ? i : j);
    }
    for (std::size_t r = 0; r < slack_rows_.size(); ++r) {
      const auto& unknowns = slack_rows_[r].unknowns;
      if (unknowns.empty()) continue;
      int g = group_of_[unknowns[0]];
      for (int i : unknowns) g = std::min(g, group_of_[i]);
      groups_[g].rows.push_back(int(r));
      groups_[g].border.insert(groups_[g].border.end(), unknowns.begin(), unknowns.end());
    }
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      auto& border = groups_[g].border;
      for (int child : groups_[g].children)
        border.insert(border.end(), groups_[child].border.begin(), groups_[child].border.end());
      border.erase(std::remove_if(border.begin(), border.end(),
                                  [&](int i) { return group_of_[i] <= int(g); }),
                   border.end());
      std::sort(border.begin(), border.end(), [&](int a, int b) { return rank_[a] < rank_[b]; });
      border.erase(std::unique(border.begin(), border.end()), border.end());
      if (!border.empty()) groups_[group_of_[border[0]]].children.push_back(int(g));
    }
    factors_.assign(groups_.size(), Factor());
  }

  // A slack has one neighbour, its row; neither touches another such pair.
  void find_slack_rows() {
    slack_rows_.clear();
    in_slack_row_.assign(n_, -1);
    vector<vector<int>> neighbours(n_);
    for (std::size_t e = 0; e < rows_.size(); ++e) {
      const int i = rows_[e] - 1, j = columns_[e] - 1;
      if (i == j) continue;
      neighbours[i].push_back(j);
      neighbours[j].push_back(i);
    }
    for (auto& of : neighbours) {
      std::sort(of.begin(), of.end());
      of.erase(std::unique(of.begin(), of.end()), of.end());
    }
    for (int s = 0; s < n_; ++s) {
      if (neighbours[s].size() != 1) continue;
      const int row = neighbours[s][0];
      const auto taken = [&](int i) { return in_slack_row_[i] >= 0; };
      if (taken(s) || taken(row) || neighbours[row].size() < 2 ||
          std::any_of(neighbours[row].begin(), neighbours[row].end(), taken))
        continue;
      in_slack_row_[s] = in_slack_row_[row] = int(slack_rows_.size());
      slack_rows_.push_back({s, row, {}, {}, {}, {}, {}, 0, 0, 0, {}});
    }
    for (std::size_t e = 0; e < rows_.size(); ++e) {
      const int i = rows_[e] - 1, j = columns_[e] - 1;
      const int which = std::max(in_slack_row_[i], in_slack_row_[j]);
      if (which < 0) continue;
      auto& s = slack_rows_[which];
      if (i == j)
        (i == s.slack ? s.slack_entries : s.row_entries).push_back(int(e));
      else if (i == s.slack || j == s.slack)
        s.coupling_entries.push_back(int(e));
      else {
        s.unknowns.push_back(i == s.row ? j : i);
        s.unknown_entries.push_back(int(e));
      }
    }
  }

  bool eliminate(SlackRow& s, const double* values) {
    const auto sum = [&](const vector<int>& entries) {
      double total = 0;
      for (int e : entries) total += values[e];
      return total;
    };
    const double ss = sum(s.slack_entries), sr = sum(s.coupling_entries), rr = sum(s.row_entries);
    const double determinant = ss * rr - sr * sr;
    if (std::fabs(determinant) <= kZero) return false;
    negative_ += determinant < 0 ? 1 : (ss < 0 ? 2 : 0);
    s.inverse_ss = rr / determinant;
    s.inverse_sr = -sr / determinant;
    s.inverse_rr = ss / determinant;
    s.values.resize(s.unknowns.size());
    for (std::size_t i = 0; i < s.values.size(); ++i) s.values[i] = values[s.unknown_entries[i]];
    return true;
  }

  bool factorise(int g, const double* values, double threshold) {
    const Group& group = groups_[g];
    Factor& factor = factors_[g];
    auto& index = factor.index;
    index.assign(pivot_order_.begin() + group.begin, pivot_order_.begin() + group.end);
    for (int child : group.children) {
      const auto from = factors_[child].index.begin();
      index.insert(index.end(), from + factors_[child].pivots,
                   from + updates_[child].front.candidates);
    }
    const int candidates = int(index.size());
    index.insert(index.end(), group.border.begin(), group.border.end());
    const int size = int(index.size());
    for (int i = 0; i < size; ++i) position_[index[i]] = i;

    Update& update = updates_[g];
    Front& front = update.front;
    front = {size, padded(size), candidates, nullptr, nullptr};
    factor.stride = front.stride;
    factor.lower.resize(std::size_t(front.stride) * candidates);
    update.memory = take(std::size_t(front.stride) * (size - candidates));
    front.first = factor.lower.data();
    front.rest = update.memory.data();
    for (int k = 0; k < size; ++k) {
      const int top = k / kTileHeight * kTileHeight;
      std::fill(front.column(k) + top, front.column(k) + front.stride, 0.0);
    }
    for (int e : group.entries) add(front, position_[rows_[e] - 1], position_[columns_[e] - 1], values[e]);
    for (int r : group.rows) {
      const SlackRow& s = slack_rows_[r];
      for (std::size_t j = 0; j < s.unknowns.size(); ++j)
        for (std::size_t i = 0; i <= j; ++i)
          add(front, position_[s.unknowns[i]], position_[s.unknowns[j]],
              -s.inverse_rr * s.values[i] * s.values[j]);
    }
    for (int child : group.children) extend(front, child);

    Elimination elimination(front, index.data(), factor.d, threshold);
    factor.pivots = elimination.run(candidates);
    negative_ += elimination.negative;
    delayed_ += candidates - factor.pivots;
    const double rest = size - factor.pivots, p = factor.pivots;
    operations_ += p * (rest * rest + rest * p + p * p / 3);
    if (group.border.empty()) give_back(update);
    return candidates - factor.pivots <= (group.border.empty() ? 0 : kMostDelayed);
  }

  static void add(Front& front, int i, int j, double value) {
    front.at(std::max(i, j), std::min(i, j)) += value;
  }

  // Add what is left of a front to a later one.
  void extend(Front& front, int child) {
    const Front& from = updates_[child].front;
    const auto& index = factors_[child].index;
    const int begin = factors_[child].pivots;
    places_.resize(from.size);
    for (int i = begin; i < from.size; ++i) places_[i] = position_[index[i]];
    runs_.clear();  // where runs of rows end that stay neighbours
    for (int i = begin + 1; i <= from.size; ++i)
      if (i == from.size || places_[i] != places_[i - 1] + 1) runs_.push_back(i);
    auto run = runs_.begin();
    for (int j = begin; j < from.size; ++j) {
      if (j == *run) ++run;
      const double* column = from.column(j);
      int i = j;
      for (auto end = run; end != runs_.end(); i = *end++) {
        const int to = places_[i], count = *end - i;
        if (to >= places_[j]) {
          double* __restrict sum = front.column(places_[j]) + to;
          for (int k = 0; k < count; ++k) sum[k] += column[i + k];
        } else {
          for (int k = 0; k < count; ++k) front.at(places_[j], to + k) += column[i + k];
        }
      }
    }
    give_back(updates_[child]);
  }

  vector<double> take(std::size_t size) {
    vector<double> memory;
    if (!pool_.empty()) {
      memory = std::move(pool_.back());
      pool_.pop_back();
    }
    if (memory.size() < size) memory.resize(size);
    return memory;
  }

  void give_back(Update& update) { pool_.push_back(std::move(update.memory)); }

  void forward(const Factor& factor, double* x) {
    const int size = int(factor.index.size());
    work_.resize(size);
    for (int i = 0; i < factor.pivots; ++i) work_[i] = x[factor.index[i]];
    std::fill(work_.begin() + factor.pivots, work_.end(), 0.0);
    for (int k = 0; k < factor.pivots; ++k) {
      const double y = work_[k];
      const double* __restrict l = factor.lower.data() + std::size_t(k) * factor.stride;
      double* __restrict to = work_.data();
      for (int r = k + 1; r < size; ++r) to[r] -= l[r] * y;
    }
    for (int k = 0; k < factor.pivots; ++k) {
      const double a = factor.d.diagonal[k], b = factor.d.below[k];
      if (b == 0) {
        x[factor.index[k]] = work_[k] / a;
        continue;
      }
      const double c = factor.d.diagonal[k + 1], determinant = a * c - b * b;
      x[factor.index[k]] = (c * work_[k] - b * work_[k + 1]) / determinant;
      x[factor.index[k + 1]] = (a * work_[k + 1] - b * work_[k]) / determinant;
      ++k;
    }
    for (int i = factor.pivots; i < size; ++i) x[factor.index[i]] += work_[i];
  }

  void backward(const Factor& factor, double* x) {
    const int size = int(factor.index.size());
    work_.resize(size);
    for (int i = 0; i < size; ++i) work_[i] = x[factor.index[i]];
    for (int k = factor.pivots - 1; k >= 0; --k) {
      const double* l = factor.lower.data() + std::size_t(k) * factor.stride;
      double parts[8] = {}, sum = 0;
      int r = k + 1;
      for (; r + 8 <= size; r += 8)
        for (int i = 0; i < 8; ++i) parts[i] += l[r + i] * work_[r + i];
      for (; r < size; ++r) sum += l[r] * work_[r];
      for (double part : parts) sum += part;
      work_[k] -= sum;
    }
    for (int k = 0; k < factor.pivots; ++k) x[factor.index[k]] = work_[k];
  }

  int n_, negative_ = 0, delayed_ = 0, count_ = 0;
  double operations_ = 0;
  vector<int> order_, ends_, rows_, columns_, pivot_order_, group_of_, rank_, in_slack_row_;
  vector<int> position_, places_, runs_;
  vector<Group> groups_;
  vector<SlackRow> slack_rows_;
  vector<Factor> factors_;
  vector<Update> updates_;
  vector<vector<double>> pool_;
  vector<double> work_;
};

// IPOPT asks for factors of the plain matrix first and, where its inertia shows that the problem is
// not convex there, of matrices with a growing shift.  Where the plain matrix was no use in the
// iteration before, it hardly ever is: then it is not factorised but refused at once, though not more
// than kMostSkips times in a row.  The shift decays anyway, so little is lost where it would have done.
class Attempts {
 public:
  void reset() { *this = Attempts(); }

  // Return whether these values are best refused unseen.
  bool skip(int entries, const int* rows, const int* columns, const double* values) {
    const bool again = repeated(entries, rows, columns, values);
    if (again) {
      plain_ = false;
      return false;
    }
    const bool useless = !first_ && !(plain_ && accepted_);
    first_ = false;
    plain_ = true;
    accepted_ = false;
    if (useless && skips_ < kMostSkips) {
      ++skips_;
      plain_ = false;
      return true;
    }
    skips_ = 0;
    return false;
  }

  void accept() { accepted_ = true; }

 private:
  static constexpr int kMostSkips = 8;

  // A shift changes the diagonal alone.
  bool repeated(int entries, const int* rows, const int* columns, const double* values) {
    last_.resize(entries);
    bool same = !first_;
    for (int e = 0; e < entries && same; ++e) same = rows[e] == columns[e] || last_[e] == values[e];
    if (!same) std::copy_n(values, entries, last_.begin());
    return same;
  }

  bool first_ = true, plain_ = true, accepted_ = true;
  int skips_ = 0;
  vector<double> last_;
};

thread_local StageLdl* current = nullptr;
thread_local Attempts attempts;

}  // namespace

EXPORT void* stage_ldl_new(int size, const int* order, int groups, const int* ends) {
  return new StageLdl(size, vector<int>(order, order + size), vector<int>(ends, ends + groups));
}

EXPORT void stage_ldl_free(void* solver) {
  if (current == solver) current = nullptr;
  delete static_cast<StageLdl*>(solver);
}

// Say which solver the next calls of this thread from IPOPT mean.
EXPORT void stage_ldl_use(void* solver) { current = static_cast<StageLdl*>(solver); }

EXPORT int stage_ldl_analyse(void* solver, int n, int entries, const int* rows, const int* columns) {
  return static_cast<StageLdl*>(solver)->analysed(n, entries, rows, columns);
}

EXPORT int stage_ldl_factorise(void* solver, const double* values, double threshold) {
  return static_cast<StageLdl*>(solver)->factorise(values, threshold);
}

EXPORT void stage_ldl_solve(void* solver, int count, double* x) {
  auto* ldl = static_cast<StageLdl*>(solver);
  for (int i = 0; i < count; ++i) ldl->solve(x + std::size_t(i) * ldl->size());
}

// Negative eigenvalues, columns handed on and operations of the last factorisation; their number.
EXPORT void stage_ldl_report(void* solver, double* figures) {
  auto* ldl = static_cast<StageLdl*>(solver);
  figures[0] = ldl->negative();
  figures[1] = ldl->delayed();
  figures[2] = ldl->operations();
  figures[3] = ldl->count();
}

// The routines of MA57 that IPOPT calls; the factors stay here, its work arrays are not used.

EXPORT void ma57id_(double*, int*) {}

EXPORT void ma57ad_(int* n, int* entries, const int* rows, const int* columns, int*, int*, int*, int*,
                    int* info, double*) {
  const bool known = current && current->analysed(*n, *entries, rows, columns);
  attempts.reset();
  info[0] = known ? 0 : -1;
  info[8] = info[9] = 1;
}

EXPORT void ma57bd_(int*, int*, double* values, double*, int*, int*, int*, int*, int*, int*, int*,
                    double* control, int* info, double*) {
  info[0] = 0;
  info[23] = info[24] = current->size();  // of a refused matrix: more than there can be
  if (attempts.skip(current->entries(), current->rows(), current->columns(), values)) return;
  const bool regular = current->factorise(values, control[0]);
  info[0] = regular ? 0 : 4;
  info[23] = current->negative();
  info[24] = regular ? current->size() : current->size() - 1;
}

EXPORT void ma57cd_(int*, int*, double*, int*, int*, int*, int* count, double* x, int*, double*, int*,
                    int*, int*, int* info) {
  attempts.accept();
  for (int i = 0; i < *count; ++i) current->solve(x + std::size_t(i) * current->size());
  info[0] = 0;
}

EXPORT void ma57ed_(int*, int*, int*, double*, int*, double*, int*, int*, int*, int*, int*, int* info) {
  info[0] = -1;
}
