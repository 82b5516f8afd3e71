// SPDX-License-Identifier: GPL-2.0-or-later
// The alternation of the ALUP paper (Sec. 3.3.2, 3.4; Eq. 14-22) in C++ with Eigen: what this project's
// solver is timed against (against_paper.py).
//
//     paper PROBLEM [--iterations N] [--increments N] [--rules] [--until F] [--output FILE]
//
// It solves one round.  Positions for fixed edge lengths l minimise
//
//       sum_<ij> max(1,l^2)/l^2 (n . x)^2 + max(1,l^2)/l^2 |x - l d0|^2                  x = v_j - v_i
//     + 2 w_s sum_S |(v_j-v_i)/l_ij - (v_i-v_k)/l_ik - bend|^2 + w_c sum_h |v_h-p_h|^2
//     + sum_T w_t |x - x0|^2
//
// and lengths for fixed positions minimise  sum (l_ij - |x|)^2 + sum_turns w (l_ij - r l_ik)^2.
//
// Made to be fast: vertices are renumbered once into the elimination order (AMD on the graph of vertices),
// so that neither factorisation nor solution permutes anything (a fifth faster than SimplicialLDLT's own use
// of AMD); every nonzero of the matrix of positions is written in place through offsets found once; its
// pattern is analysed once; the matrix of lengths, which is constant, is factorised once.  Positions are
// solved for as increments from the last ones, because the matrix' condition number of 1e9 and more spoils a
// direct solution.
//
// The file: little-endian; the 8 characters "ALUP-1\n\0"; int32 N, E, Q, K, H, T; float64 weights of normal,
// tangent, edge, straight, handle; then the arrays, row by row, float64 or int32 (marked i):
//     start (N,2); edges (E,2) i; normals (E,2); lengths (E); directions (E,2);
//     turn_ij (Q) i; turn_ik (Q) i; ratio (Q); turn_weight (Q);
//     straight (K,3) i; straight_ij (K) i; straight_ik (K) i; bend (K,2);
//     handles (H) i; targets (H,2); scaffold (T,2) i; scaffold_vector (T,2); scaffold_weight (T)
// The names and units are those of `Problem` in alup/energy/problem.py.  The output file has the last positions,
// float64 (N,2), with --rules the best ones.
//
// With --until the iterations end as soon as the objective F is no more than the value given.
//
// Printed is one JSON object.  `seconds` is the processor time of the set-up, the analysis and all iterations,
// without reading the file.  Energies are evaluated after every iteration; the rules need E_ALUP, so with
// --rules that time is counted, without them it is not, nor what it takes to see that --until is met.  Of the energies of the iterations, `best_alup` and `least_objective` are
// the least, `objective_at_best` is F where E_ALUP was least, and the others are the last.

#include <Eigen/Sparse>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

using Eigen::Vector2d;
using Eigen::VectorXd;
using Index = std::int32_t;
using Matrix = Eigen::SparseMatrix<double, Eigen::ColMajor, Index>;
using Points = std::vector<Vector2d>;

namespace {

struct Pair { Index i, j; };
struct Triple { Index i, j, k; };

struct Problem {
    double normal, tangent, edge, straight, handle;  // weights
    Points start;
    std::vector<Pair> edges;
    Points normals;
    std::vector<double> lengths;
    Points directions;
    std::vector<Index> turn_ij, turn_ik;
    std::vector<double> ratio, turn_weight;
    std::vector<Triple> turns;  // straight ones
    std::vector<Index> straight_ij, straight_ik;
    Points bend;
    std::vector<Index> handles;
    Points targets;
    std::vector<Pair> scaffold;
    Points scaffold_vector;
    std::vector<double> scaffold_weight;
};

class Reader {
public:
    explicit Reader(const std::string& path) : file_(path, std::ios::binary) {
        if (!file_) throw std::runtime_error("can't open " + path);
    }

    template <class T>
    void read(T* to, std::size_t count) {
        file_.read(reinterpret_cast<char*>(to), static_cast<std::streamsize>(count * sizeof(T)));
        if (!file_) throw std::runtime_error("the problem's file is too short");
    }

    template <class T>
    void read(std::vector<T>& to, Index count) {
        to.resize(static_cast<std::size_t>(count));
        read(to.data(), to.size());
    }

private:
    std::ifstream file_;
};

Problem read_problem(const std::string& path) {
    Reader in(path);
    char magic[8];
    in.read(magic, 8);
    if (std::memcmp(magic, "ALUP-1\n\0", 8) != 0) throw std::runtime_error("not a problem's file: " + path);
    Index n[6];
    in.read(n, 6);
    const auto [vertices, edges, turns, straight, handles, scaffold] = n;
    Problem p;
    double weights[5];
    in.read(weights, 5);
    p.normal = weights[0], p.tangent = weights[1], p.edge = weights[2];
    p.straight = weights[3], p.handle = weights[4];
    in.read(p.start, vertices);
    in.read(p.edges, edges);
    in.read(p.normals, edges);
    in.read(p.lengths, edges);
    in.read(p.directions, edges);
    in.read(p.turn_ij, turns);
    in.read(p.turn_ik, turns);
    in.read(p.ratio, turns);
    in.read(p.turn_weight, turns);
    in.read(p.turns, straight);
    in.read(p.straight_ij, straight);
    in.read(p.straight_ik, straight);
    in.read(p.bend, straight);
    in.read(p.handles, handles);
    in.read(p.targets, handles);
    in.read(p.scaffold, scaffold);
    in.read(p.scaffold_vector, scaffold);
    in.read(p.scaffold_weight, scaffold);
    return p;
}

// Renumbers the vertices into an order of little fill.  Returns the new number of each.
std::vector<Index> renumber(Problem& p) {
    const auto count = static_cast<Index>(p.start.size());
    std::vector<Eigen::Triplet<double, Index>> joined;
    joined.reserve(count + 2 * (p.edges.size() + p.turns.size() + p.scaffold.size()));
    const auto join = [&](Index a, Index b) {
        joined.emplace_back(a, b, 1.0);
        joined.emplace_back(b, a, 1.0);
    };
    for (Index a = 0; a < count; ++a) joined.emplace_back(a, a, 1.0);
    for (const auto& [i, j] : p.edges) join(i, j);
    for (const auto& t : p.turns) join(t.j, t.k);
    for (const auto& [i, j] : p.scaffold) join(i, j);
    Matrix graph(count, count);
    graph.setFromTriplets(joined.begin(), joined.end());
    Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, Index> order;
    Eigen::AMDOrdering<Index>()(graph, order);

    std::vector<Index> rank(static_cast<std::size_t>(count));
    for (Index place = 0; place < count; ++place) rank[order.indices()[place]] = place;
    Points start(p.start.size());
    for (Index a = 0; a < count; ++a) start[rank[a]] = p.start[a];
    p.start = std::move(start);
    for (auto& [i, j] : p.edges) i = rank[i], j = rank[j];
    for (auto& t : p.turns) t = {rank[t.i], rank[t.j], rank[t.k]};
    for (auto& h : p.handles) h = rank[h];
    for (auto& [i, j] : p.scaffold) i = rank[i], j = rank[j];
    return rank;
}

// max(1, l^2) / l^2
double edge_weight(double l) { return std::max(1.0, 1.0 / (l * l)); }

// The positions step.  Unknowns x_i at 2 i, y_i at 2 i + 1; the upper triangle is stored.
class Positions {
public:
    explicit Positions(const Problem& p) : p_(p), matrix_(2 * p.start.size(), 2 * p.start.size()) {
        make_pattern();
        const auto block = [&](Index a, Index b) {
            return Block{at(a, b, 0, 0), at(a, b, 0, 1), at(a, b, 1, 0), at(a, b, 1, 1)};
        };
        edges_.reserve(p.edges.size());
        for (const auto& [i, j] : p.edges) edges_.push_back({block(i, i), block(j, j), block(i, j)});
        turns_.reserve(p.turns.size());
        for (const auto& t : p.turns) {
            Turn turn;
            for (int d = 0; d < 2; ++d) {
                const auto same = [&](Index a, Index b) { return at(a, b, d, d); };
                turn.jj[d] = same(t.j, t.j), turn.kk[d] = same(t.k, t.k), turn.ii[d] = same(t.i, t.i);
                turn.jk[d] = same(t.j, t.k), turn.ij[d] = same(t.i, t.j), turn.ik[d] = same(t.i, t.k);
            }
            turns_.push_back(turn);
        }
        constant_ = VectorXd::Zero(matrix_.nonZeros());
        for (std::size_t t = 0; t < p.scaffold.size(); ++t)
            for (int d = 0; d < 2; ++d) {
                const auto& [i, j] = p.scaffold[t];
                constant_[at(i, i, d, d)] += p.scaffold_weight[t];
                constant_[at(j, j, d, d)] += p.scaffold_weight[t];
                constant_[at(i, j, d, d)] -= p.scaffold_weight[t];
            }
        for (const Index h : p.handles)
            for (int d = 0; d < 2; ++d) constant_[at(h, h, d, d)] += p.handle;
        gradient_.resize(matrix_.rows());
        increment_.resize(matrix_.rows());
        solver_.analyzePattern(matrix_);
    }

    void factorize(const std::vector<double>& l) {
        assemble(l);
        solver_.factorize(matrix_);
        if (solver_.info() != Eigen::Success) throw std::runtime_error("the matrix of positions is singular");
    }

    // Goes from v to the minimiser for these lengths, which `factorize` has been told.  Returns the largest
    // move of a vertex.
    double improve(Points& v, const std::vector<double>& l) {
        evaluate_gradient(v, l);
        increment_ = solver_.solve(gradient_);
        double largest = 0.0;
        for (std::size_t a = 0; a < v.size(); ++a) {
            const Vector2d move = increment_.segment<2>(2 * a);
            v[a] -= move;
            largest = std::max(largest, move.squaredNorm());
        }
        return std::sqrt(largest);
    }

private:
    struct Block { Index xx, xy, yx, yy; };            // where a 2x2 block is among the nonzeros
    struct Edge { Block ii, jj, ij; };
    struct Turn { Index jj[2], kk[2], ii[2], jk[2], ij[2], ik[2]; };

    void make_pattern() {
        std::vector<Eigen::Triplet<double, Index>> entries;
        entries.reserve(3 * p_.start.size() + 4 * p_.edges.size() + 2 * (p_.turns.size() + p_.scaffold.size()));
        const auto add = [&](Index row, Index column) {
            entries.emplace_back(std::min(row, column), std::max(row, column), 0.0);
        };
        for (Index a = 0; a < static_cast<Index>(p_.start.size()); ++a)
            add(2 * a, 2 * a), add(2 * a, 2 * a + 1), add(2 * a + 1, 2 * a + 1);
        for (const auto& [i, j] : p_.edges)
            for (int c = 0; c < 2; ++c)
                for (int d = 0; d < 2; ++d) add(2 * i + c, 2 * j + d);
        for (int d = 0; d < 2; ++d) {
            // The pairs (i, j) and (i, k) of a turn are edges.
            for (const auto& t : p_.turns) add(2 * t.j + d, 2 * t.k + d);
            for (const auto& [i, j] : p_.scaffold) add(2 * i + d, 2 * j + d);
        }
        matrix_.setFromTriplets(entries.begin(), entries.end());
    }

    // Where among the nonzeros coordinate c of vertex a meets coordinate d of vertex b.
    Index at(Index a, Index b, int c, int d) const {
        const Index row = std::min(2 * a + c, 2 * b + d), column = std::max(2 * a + c, 2 * b + d);
        const Index* inner = matrix_.innerIndexPtr();
        const Index* outer = matrix_.outerIndexPtr();
        const Index* found = std::lower_bound(inner + outer[column], inner + outer[column + 1], row);
        return static_cast<Index>(found - inner);
    }

    void assemble(const std::vector<double>& l) {
        double* value = matrix_.valuePtr();
        std::copy(constant_.data(), constant_.data() + constant_.size(), value);
        for (std::size_t e = 0; e < edges_.size(); ++e) {
            const double a = edge_weight(l[e]);
            const Vector2d& n = p_.normals[e];
            const double xx = a * (p_.normal * n.x() * n.x() + p_.edge), xy = a * p_.normal * n.x() * n.y(),
                         yy = a * (p_.normal * n.y() * n.y() + p_.edge);
            const auto& [ii, jj, ij] = edges_[e];
            value[ii.xx] += xx, value[ii.xy] += xy, value[ii.yy] += yy;
            value[jj.xx] += xx, value[jj.xy] += xy, value[jj.yy] += yy;
            value[ij.xx] -= xx, value[ij.xy] -= xy, value[ij.yx] -= xy, value[ij.yy] -= yy;
        }
        const double factor = 2.0 * p_.straight;
        for (std::size_t k = 0; k < turns_.size(); ++k) {
            // alpha x_j - (alpha + beta) x_i + beta x_k, squared
            const double alpha = 1.0 / l[p_.straight_ij[k]], beta = 1.0 / l[p_.straight_ik[k]];
            const double sum = alpha + beta;
            const Turn& t = turns_[k];
            for (int d = 0; d < 2; ++d) {
                value[t.jj[d]] += factor * alpha * alpha;
                value[t.kk[d]] += factor * beta * beta;
                value[t.ii[d]] += factor * sum * sum;
                value[t.jk[d]] += factor * alpha * beta;
                value[t.ij[d]] -= factor * alpha * sum;
                value[t.ik[d]] -= factor * beta * sum;
            }
        }
    }

    // Half the gradient, summed residual by residual.
    void evaluate_gradient(const Points& v, const std::vector<double>& l) {
        gradient_.setZero();
        const auto at = [&](Index a) { return gradient_.segment<2>(2 * a); };
        for (std::size_t e = 0; e < p_.edges.size(); ++e) {
            const auto& [i, j] = p_.edges[e];
            const Vector2d x = v[j] - v[i];
            const Vector2d& n = p_.normals[e];
            const Vector2d straying = x - l[e] * p_.directions[e];
            const Vector2d pull = edge_weight(l[e]) * (p_.normal * n.dot(x) * n + p_.edge * straying);
            at(j) += pull;
            at(i) -= pull;
        }
        for (std::size_t k = 0; k < p_.turns.size(); ++k) {
            const Triple& t = p_.turns[k];
            const double alpha = 1.0 / l[p_.straight_ij[k]], beta = 1.0 / l[p_.straight_ik[k]];
            const Vector2d residual =
                2.0 * p_.straight * (alpha * (v[t.j] - v[t.i]) - beta * (v[t.i] - v[t.k]) - p_.bend[k]);
            at(t.j) += alpha * residual;
            at(t.k) += beta * residual;
            at(t.i) -= (alpha + beta) * residual;
        }
        for (std::size_t t = 0; t < p_.scaffold.size(); ++t) {
            const auto& [i, j] = p_.scaffold[t];
            const Vector2d pull = p_.scaffold_weight[t] * (v[j] - v[i] - p_.scaffold_vector[t]);
            at(j) += pull;
            at(i) -= pull;
        }
        for (std::size_t h = 0; h < p_.handles.size(); ++h)
            at(p_.handles[h]) += p_.handle * (v[p_.handles[h]] - p_.targets[h]);
    }

    const Problem& p_;
    Matrix matrix_;
    VectorXd constant_, gradient_, increment_;
    std::vector<Edge> edges_;
    std::vector<Turn> turns_;
    // The vertices' order is already one of little fill.
    Eigen::SimplicialLDLT<Matrix, Eigen::Upper, Eigen::NaturalOrdering<Index>> solver_;
};

// The lengths step.
class Lengths {
public:
    explicit Lengths(const Problem& p) : p_(p), now_(p.edges.size()), result_(p.edges.size()) {
        const auto count = static_cast<Index>(p.edges.size());
        std::vector<Eigen::Triplet<double, Index>> entries;
        entries.reserve(p.edges.size() + 3 * p.ratio.size());
        for (Index e = 0; e < count; ++e) entries.emplace_back(e, e, 1.0);
        for (std::size_t q = 0; q < p.ratio.size(); ++q) {
            const Index a = p.turn_ij[q], b = p.turn_ik[q];
            const double w = p.tangent * p.turn_weight[q], r = p.ratio[q];
            entries.emplace_back(a, a, w);
            entries.emplace_back(b, b, w * r * r);
            entries.emplace_back(std::min(a, b), std::max(a, b), -w * r);
        }
        Matrix matrix(count, count);
        matrix.setFromTriplets(entries.begin(), entries.end());
        solver_.compute(matrix);
        if (solver_.info() != Eigen::Success) throw std::runtime_error("the matrix of lengths is singular");
    }

    void solve(const Points& v, std::vector<double>& l) {
        for (std::size_t e = 0; e < l.size(); ++e) now_[e] = (v[p_.edges[e].j] - v[p_.edges[e].i]).norm();
        result_ = solver_.solve(now_);
        std::copy(result_.data(), result_.data() + result_.size(), l.begin());
    }

private:
    const Problem& p_;
    VectorXd now_, result_;
    Eigen::SimplicialLDLT<Matrix, Eigen::Upper, Eigen::AMDOrdering<Index>> solver_;
};

struct Energy {
    double alup;       // Eq. 13
    double objective;  // F = E_ALUP + E_edge + E_comp
};

class Energies {
public:
    explicit Energies(const Problem& p) : p_(p), lengths_(p.edges.size()), units_(p.edges.size()) {}

    Energy evaluate(const Points& v) {
        double normal = 0.0, edge = 0.0, tangent = 0.0, straight = 0.0, handle = 0.0, component = 0.0;
        for (std::size_t e = 0; e < p_.edges.size(); ++e) {
            const Vector2d x = v[p_.edges[e].j] - v[p_.edges[e].i];
            const double length = x.norm();
            lengths_[e] = length;
            units_[e] = x / std::max(length, 1e-300);
            const double weight = std::max(1.0, length * length), across = p_.normals[e].dot(units_[e]);
            normal += weight * across * across;
            edge += weight * (units_[e] - p_.directions[e]).squaredNorm();
        }
        for (std::size_t q = 0; q < p_.ratio.size(); ++q) {
            const double difference = lengths_[p_.turn_ij[q]] - p_.ratio[q] * lengths_[p_.turn_ik[q]];
            tangent += p_.turn_weight[q] * difference * difference;
        }
        for (std::size_t k = 0; k < p_.turns.size(); ++k) {
            const Index i = p_.turns[k].i, a = p_.straight_ij[k], b = p_.straight_ik[k];
            // From i to j, and from k to i.
            const Vector2d on = p_.edges[a].i == i ? units_[a] : Vector2d(-units_[a]);
            const Vector2d to = p_.edges[b].j == i ? units_[b] : Vector2d(-units_[b]);
            straight += (on - to - p_.bend[k]).squaredNorm();
        }
        for (std::size_t h = 0; h < p_.handles.size(); ++h)
            handle += (v[p_.handles[h]] - p_.targets[h]).squaredNorm();
        for (std::size_t t = 0; t < p_.scaffold.size(); ++t) {
            const auto& [i, j] = p_.scaffold[t];
            component += p_.scaffold_weight[t] * (v[j] - v[i] - p_.scaffold_vector[t]).squaredNorm();
        }
        const double alup = p_.normal * normal + p_.tangent * tangent + 2.0 * p_.straight * straight +
                            p_.handle * handle;
        return {alup, alup + p_.edge * edge + component};
    }

private:
    const Problem& p_;
    std::vector<double> lengths_;
    Points units_;
};

struct Arguments {
    std::string problem, output;
    int iterations = 100, increments = 1;
    double until = -std::numeric_limits<double>::infinity();
    bool rules = false;

    Arguments(int count, char** values) {
        for (int n = 1; n < count; ++n) {
            const std::string word = values[n];
            const auto next = [&]() -> std::string {
                if (++n == count) throw std::runtime_error(word + " needs a value");
                return values[n];
            };
            if (word == "--rules") rules = true;
            else if (word == "--iterations") iterations = std::stoi(next());
            else if (word == "--increments") increments = std::stoi(next());
            else if (word == "--until") until = std::stod(next());
            else if (word == "--output") output = next();
            else problem = word;
        }
        if (problem.empty() || iterations < 1 || increments < 1)
            throw std::runtime_error(
                "usage: paper PROBLEM [--iterations N] [--increments N] [--rules] [--until F] [--output FILE]");
    }
};

// The stopping rules of Sec. 3.4: least decrease of E_ALUP, and least step in mean edge lengths.
constexpr double LEAST_DECREASE = 1e-4, LEAST_STEP = 1e-4;

// Processor time: the machine may have other work.
double now_seconds() {
    timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double since(double start) { return now_seconds() - start; }

// The most memory that was resident.  getrusage's figure includes that of the process that started this one,
// so it serves only where there is no /proc.
long peak_kilobytes() {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);)
        if (line.compare(0, 6, "VmHWM:") == 0) return std::stol(line.substr(6));
    rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_maxrss;
}

void write_positions(const std::string& path, const Points& v, const std::vector<Index>& rank) {
    std::ofstream out(path, std::ios::binary);
    for (const Index place : rank)
        out.write(reinterpret_cast<const char*>(v[place].data()), 2 * sizeof(double));
    if (!out.flush()) throw std::runtime_error("can't write " + path);
}

void run(const Arguments& given) {
    Problem problem = read_problem(given.problem);

    auto begin = now_seconds();
    const std::vector<Index> rank = renumber(problem);
    Positions positions(problem);
    Lengths lengths(problem);
    Energies energies(problem);
    const double setup = since(begin);

    Points v = problem.start, best_v = v;
    std::vector<double> l = problem.lengths;
    const char* status = "ITERATIONS";
    double stepping = 0.0, evaluating = 0.0;
    begin = now_seconds();
    Energy now = energies.evaluate(v), best = now;
    evaluating += since(begin);
    double least_objective = std::numeric_limits<double>::infinity();
    int iteration = 0;
    while (iteration < given.iterations) {
        begin = now_seconds();
        positions.factorize(l);
        double largest = 0.0;
        for (int n = 0; n < given.increments; ++n) largest = std::max(largest, positions.improve(v, l));
        lengths.solve(v, l);
        stepping += since(begin);
        ++iteration;

        begin = now_seconds();
        const double before = now.alup;
        now = energies.evaluate(v);
        least_objective = std::min(least_objective, now.objective);
        if (now.alup < best.alup) best = now, best_v = v;
        evaluating += since(begin);
        if (now.objective <= given.until) {
            status = "REACHED";
            break;
        }
        if (!given.rules) continue;
        if (now.alup > before) status = "RISE";
        else if (before - now.alup < LEAST_DECREASE) status = "DECREASE";
        else if (largest < LEAST_STEP) status = "STEP";
        else continue;
        break;
    }
    if (!given.output.empty()) write_positions(given.output, given.rules ? best_v : v, rank);
    const double seconds = setup + stepping + (given.rules ? evaluating : 0.0);
    std::printf("{\"vertices\": %zu, \"iterations\": %d, \"status\": \"%s\", ", v.size(), iteration, status);
    std::printf("\"seconds\": %.9f, \"setup_seconds\": %.9f, ", seconds, setup);
    std::printf("\"iteration_seconds\": %.9f, ", (seconds - setup) / std::max(iteration, 1));
    std::printf("\"alup\": %.17g, \"objective\": %.17g, ", now.alup, now.objective);
    std::printf("\"best_alup\": %.17g, \"objective_at_best\": %.17g, ", best.alup, best.objective);
    std::printf("\"least_objective\": %.17g, ", least_objective);
    std::printf("\"peak_kilobytes\": %ld, ", peak_kilobytes());
    std::printf("\"eigen\": \"%d.%d.%d\"}\n", EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION);
}

}  // namespace

int main(int count, char** values) {
    try {
        run(Arguments(count, values));
    } catch (const std::exception& error) {
        std::fprintf(stderr, "paper: %s\n", error.what());
        return 1;
    }
    return 0;
}
