// Interpreter of scalar expression tapes, eight occurrences at a time.
//
// A tape is the instruction list of a CasADi SX function.  Each of its registers holds the values
// of eight occurrences, so that decoding an instruction is paid once for eight results.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <vector>

namespace {

constexpr int kLanes = 8;
typedef double Lanes __attribute__((vector_size(kLanes * sizeof(double))));

struct Instruction {
  std::int32_t operation;
  std::int32_t target;  // register; the output's number for OUTPUT
  union {
    std::int32_t from[2];  // registers; source and row for INPUT; register and row for OUTPUT
    double constant;
  };
};
static_assert(sizeof(Instruction) == 16, "Python writes these as four int32");

// The order is that of OPERATIONS in tape.py.
#define PLAIN_OPERATIONS(X)                                                                        \
  X(ASSIGN, a)                                                                                     \
  X(ADD, a + b)                                                                                    \
  X(SUB, a - b)                                                                                    \
  X(MUL, a * b)                                                                                    \
  X(DIV, a / b)                                                                                    \
  X(NEG, -a)                                                                                       \
  X(SQ, a * a)                                                                                     \
  X(TWICE, a + a)                                                                                  \
  X(INV, 1.0 / a)                                                                                  \
  X(LT, (a < b) ? one : zero)                                                                      \
  X(LE, (a <= b) ? one : zero)                                                                     \
  X(EQ, (a == b) ? one : zero)                                                                     \
  X(NE, (a != b) ? one : zero)                                                                     \
  X(NOT, (a == zero) ? one : zero)                                                                 \
  X(AND, ((a != zero) & (b != zero)) ? one : zero)                                                 \
  X(OR, ((a != zero) | (b != zero)) ? one : zero)                                                  \
  X(IF_ELSE_ZERO, (a == zero) ? zero : b)

#define CALLED_OPERATIONS(X)                                                                       \
  X(FABS, std::fabs(a))                                                                            \
  X(SQRT, std::sqrt(a))                                                                            \
  X(EXP, std::exp(a))                                                                              \
  X(LOG, std::log(a))                                                                              \
  X(POW, std::pow(a, b))                                                                           \
  X(CONSTPOW, std::pow(a, b))                                                                      \
  X(SIN, std::sin(a))                                                                              \
  X(COS, std::cos(a))                                                                              \
  X(TAN, std::tan(a))                                                                              \
  X(ASIN, std::asin(a))                                                                            \
  X(ACOS, std::acos(a))                                                                            \
  X(ATAN, std::atan(a))                                                                            \
  X(ATAN2, std::atan2(a, b))                                                                       \
  X(SINH, std::sinh(a))                                                                            \
  X(COSH, std::cosh(a))                                                                            \
  X(TANH, std::tanh(a))                                                                            \
  X(ASINH, std::asinh(a))                                                                          \
  X(ACOSH, std::acosh(a))                                                                          \
  X(ATANH, std::atanh(a))                                                                          \
  X(FMIN, std::fmin(a, b))                                                                         \
  X(FMAX, std::fmax(a, b))                                                                         \
  X(FLOOR, std::floor(a))                                                                          \
  X(CEIL, std::ceil(a))                                                                            \
  X(FMOD, std::fmod(a, b))                                                                         \
  X(COPYSIGN, std::copysign(a, b))                                                                 \
  X(ERF, std::erf(a))                                                                              \
  X(LOG1P, std::log1p(a))                                                                          \
  X(EXPM1, std::expm1(a))                                                                          \
  X(HYPOT, std::hypot(a, b))                                                                       \
  X(SIGN, a < 0.0 ? -1.0 : (a > 0.0 ? 1.0 : a))

enum Operation : std::int32_t {
  CONST,
  INPUT,
  OUTPUT,
#define NAME(name, expression) name,
  PLAIN_OPERATIONS(NAME) CALLED_OPERATIONS(NAME)
#undef NAME
  kOperations
};

// Instructions in the order in which they shall run; instruction k computes value k.
//
// Like operations run in a row as far as possible: the processor then foresees the next one, which
// saves more than the longer lives of values cost.
class Schedule {
 public:
  Schedule(const Instruction* code, std::int64_t size)
      : code_(code, code + size), waiting_(size), users_(size) {
    std::vector<std::int32_t> writer;
    for (std::int32_t k = 0; k < size; ++k) {
      Instruction& it = code_[k];
      for (int j = 0; j < operands(it); ++j) {
        it.from[j] = writer[it.from[j]];
        users_[it.from[j]].push_back(k);
        ++waiting_[k];
      }
      if (it.operation == OUTPUT) continue;
      if (writer.size() <= static_cast<std::size_t>(it.target)) writer.resize(it.target + 1);
      writer[it.target] = k;
    }
    for (std::int32_t k = 0; k < size; ++k) {
      if (waiting_[k] == 0) ready_[code_[k].operation].push_back(k);
    }
    order();
  }

  // Write the instructions in their order, and return how many registers they need.
  std::int64_t write(Instruction* result) const {
    std::vector<std::size_t> uses_left(code_.size());
    std::vector<std::int32_t> place(code_.size()), free;
    std::int32_t registers = 0;
    for (std::size_t k = 0; k < code_.size(); ++k) uses_left[k] = users_[k].size();
    for (std::int32_t k : order_) {
      Instruction it = code_[k];
      for (int j = 0; j < operands(it); ++j) {
        const std::int32_t value = it.from[j];
        it.from[j] = place[value];
        if (--uses_left[value] == 0) free.push_back(place[value]);
      }
      if (it.operation != OUTPUT) {
        if (free.empty()) free.push_back(registers++);
        it.target = place[k] = free.back();
        if (uses_left[k] > 0) free.pop_back();
      }
      *result++ = it;
    }
    return registers;
  }

 private:
  static int operands(const Instruction& it) {
    return it.operation == CONST || it.operation == INPUT ? 0 : it.operation == OUTPUT ? 1 : 2;
  }

  void order() {
    const auto fewer = [](const auto& a, const auto& b) { return a.size() < b.size(); };
    for (;;) {
      auto& longest = *std::max_element(ready_.begin(), ready_.end(), fewer);
      if (longest.empty()) return;
      while (!longest.empty()) {
        const std::int32_t k = longest.front();
        longest.pop_front();
        order_.push_back(k);
        for (std::int32_t user : users_[k]) {
          if (--waiting_[user] == 0) ready_[code_[user].operation].push_back(user);
        }
      }
    }
  }

  std::vector<Instruction> code_;
  std::vector<std::int32_t> waiting_, order_;
  std::vector<std::vector<std::int32_t>> users_;
  std::array<std::deque<std::int32_t>, kOperations> ready_;
};

// One tape at all occurrences of its block.
struct Run {
  const Instruction* code;
  const std::int32_t* gather;   // (groups, inputs, lanes): element of the source
  const std::int32_t* scatter;  // (groups, outputs, lanes): element of the result
  std::int64_t size;
  std::int64_t count;    // occurrences
  std::int64_t inputs;   // rows of gather
  std::int64_t outputs;  // rows of scatter
  std::int64_t registers;
  std::int64_t wanted;   // bit k is set where the tape adds to result k
};

void run_group(const Instruction* code, const Instruction* end, const std::int32_t* gather,
               const std::int32_t* scatter, int used, const double* const* sources,
               double* const* results, Lanes* r) {
  static const void* const labels[] = {
      &&on_CONST,
      &&on_INPUT,
      &&on_OUTPUT,
#define LABEL(name, expression) &&on_##name,
      PLAIN_OPERATIONS(LABEL) CALLED_OPERATIONS(LABEL)
#undef LABEL
  };
  constexpr Lanes zero = {};
  constexpr Lanes one = {1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0};
  const Instruction* at = code;
#define NEXT                                                                                       \
  if (++at == end) return;                                                                         \
  goto* labels[at->operation]

  if (at == end) return;
  goto* labels[at->operation];

on_CONST:
  r[at->target] = Lanes{} + at->constant;
  NEXT;

on_INPUT: {
  const double* source = sources[at->from[0]];
  const std::int32_t* place = gather + kLanes * at->from[1];
  Lanes value = {};
  for (int lane = 0; lane < kLanes; ++lane) value[lane] = source[place[lane]];
  r[at->target] = value;
  NEXT;
}

on_OUTPUT: {
  double* result = results[at->target];
  if (result) {
    const std::int32_t* place = scatter + kLanes * at->from[1];
    const double* value = reinterpret_cast<const double*>(r + at->from[0]);
    for (int lane = 0; lane < used; ++lane) result[place[lane]] += value[lane];
  }
  NEXT;
}

#define PLAIN(name, expression)                                                                    \
  on_##name : {                                                                                    \
    const Lanes a = r[at->from[0]];                                                                \
    [[maybe_unused]] const Lanes b = r[at->from[1]];                                               \
    r[at->target] = expression;                                                                    \
    NEXT;                                                                                          \
  }
  PLAIN_OPERATIONS(PLAIN)
#undef PLAIN

#define CALLED(name, expression)                                                                   \
  on_##name : {                                                                                    \
    const Lanes first = r[at->from[0]];                                                            \
    [[maybe_unused]] const Lanes second = r[at->from[1]];                                          \
    Lanes value = {};                                                                              \
    for (int lane = 0; lane < kLanes; ++lane) {                                                    \
      const double a = first[lane];                                                                \
      [[maybe_unused]] const double b = second[lane];                                              \
      value[lane] = expression;                                                                    \
    }                                                                                              \
    r[at->target] = value;                                                                         \
    NEXT;                                                                                          \
  }
  CALLED_OPERATIONS(CALLED)
#undef CALLED
#undef NEXT
}

}  // namespace

extern "C" __attribute__((visibility("default"))) void pathwalker_run_tapes(
    const Run* runs, std::int64_t count, const double* const* sources, double* const* results,
    std::int64_t result_count) {
  thread_local std::vector<Lanes> registers;
  std::int64_t asked = 0;
  for (std::int64_t k = 0; k < result_count; ++k) asked |= std::int64_t{results[k] != nullptr} << k;
  for (const Run* run = runs; run != runs + count; ++run) {
    if (!(run->wanted & asked)) continue;
    const auto needed = static_cast<std::size_t>(run->registers);
    if (registers.size() < needed) registers.resize(needed);
    for (std::int64_t first = 0, group = 0; first < run->count; first += kLanes, ++group) {
      const int used = static_cast<int>(run->count - first < kLanes ? run->count - first : kLanes);
      run_group(run->code, run->code + run->size, run->gather + group * run->inputs * kLanes,
                run->scatter + group * run->outputs * kLanes, used, sources, results,
                registers.data());
    }
  }
}

// Order the instructions of a tape for running; returns the number of registers.
extern "C" __attribute__((visibility("default"))) std::int64_t pathwalker_schedule_tape(
    const Instruction* code, std::int64_t size, Instruction* result) {
  return Schedule(code, size).write(result);
}
