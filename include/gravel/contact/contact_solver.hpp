#pragma once

/// \file
/// Solves the contacts of a step together: the run-time choice of an algorithm, with what all of them need,
/// colours, warm start, losses and correction of positions.

#include <gravel/contact/positional_correction.hpp>
#include <gravel/contact/sequential_impulses.hpp>

#include <variant>

namespace gravel {

enum class ContactSolverKind { SequentialImpulses };

/// What is remembered of a contact from step to step.
template <Real Scalar>
struct StoredImpulse {
  std::uint64_t key1;
  std::uint64_t key2;
  ContactImpulse<Scalar> impulse;

  friend bool operator==(const StoredImpulse&, const StoredImpulse&) = default;
};

/// Contacts in, velocities out. Keeps its workspace and the last step's impulses.
/// Determinism: all of it is a function of the contacts in the order of their keys; neither indices nor
/// threads change a bit.
template <Real S>
class ContactSolver {
 public:
  explicit ContactSolver(ContactSolverKind kind = ContactSolverKind::SequentialImpulses) {
    switch (kind) {
      case ContactSolverKind::SequentialImpulses:
        algorithm_.template emplace<SequentialImpulses<S>>();
        break;
    }
  }

  const char* name() const {
    return std::visit([](const auto& algorithm) { return algorithm.name(); }, algorithm_);
  }

  const ContactSettings<S>& settings() const { return settings_; }
  /// \throws std::invalid_argument on a value out of range
  void setSettings(const ContactSettings<S>& settings) {
    validate(settings);
    settings_ = settings;
  }

  /// Takes the contacts of a step and colours them; solve() and correctPositions() follow in either order.
  /// \param contacts sorted by keys; kept as a view, whose geometry may be renewed before solve()
  template <ContactBodies B>
  void begin(std::span<const Contact<S>> contacts, const B& bodies) {
    contacts_ = contacts;
    impulses_.clear();
    coloring_.build(contacts, bodies);
  }

  /// The contacts of begin(), at the place where they stand now: after they, or what owns them, were copied.
  void rebind(std::span<const Contact<S>> contacts) { contacts_ = contacts; }

  /// Changes the velocities (and, where there is friction, the spins) of the bodies so that every contact
  /// of begin() obeys restitution and Coulomb's law.
  /// \param dt [s] >= 0, the step for which the contacts stand
  template <ContactBodies B>
  ContactReport<S> solve(B& bodies, const S& dt) {
    const std::span<const Contact<S>> contacts = contacts_;
    impulses_.assign(contacts.size(), ContactImpulse<S>{});
    ContactReport<S> report;
    if (!contacts.empty()) {
      problem_.gather(contacts, bodies, coloring_, dt, settings_);
      if (problem_.active) {
        guess(dt);
        report = std::visit([&](auto& algorithm) { return algorithm.solve(problem_, coloring_, settings_); },
                            algorithm_);
        energy_.settle(problem_, coloring_, contacts, report);
        problem_.scatter(bodies, coloring_);
        takeImpulses();
      }
    }
    report.contacts = contacts.size();
    report.colours = coloring_.colours() + (coloring_.loneCount() > 0 ? 1U : 0U);
    remember(dt);
    return report;
  }

  /// begin() and solve() in one.
  template <ContactBodies B>
  ContactReport<S> solve(std::span<const Contact<S>> contacts, B& bodies, const S& dt) {
    begin(contacts, bodies);
    return solve(bodies, dt);
  }

  /// Opens the overlaps of the contacts of begin() by moving bodies.
  template <ContactBodies B>
  CorrectionReport<S> correctPositions(B& bodies, const CorrectionSettings<S>& settings) {
    return correction_.apply(contacts_, coloring_, bodies, settings);
  }

  const std::vector<Displacement<S>>& displacements() const { return correction_.displacements(); }

  /// Contacts and their impulses [N s] of the last solve(), in one order. The contacts are the caller's.
  std::span<const Contact<S>> contacts() const { return contacts_; }
  std::span<const ContactImpulse<S>> impulses() const { return impulses_; }
  const ContactColoring& coloring() const { return coloring_; }

  /// What the next solve() begins from: the impulses of the last one by keys, and its step [s]. A restart
  /// that puts them back continues with the same bits.
  const std::vector<StoredImpulse<S>>& memory() const { return memory_; }
  const S& memoryStep() const { return memoryStep_; }
  /// \param memory sorted by keys
  void setMemory(std::vector<StoredImpulse<S>> memory, const S& step) {
    memory_ = std::move(memory);
    memoryStep_ = step;
  }
  void forget() { memory_.clear(); }

 private:
  /// First guesses from the last step: forces that last, hence impulses in proportion of the steps.
  void guess(const S& dt) {
    if (!settings_.warmStart || memory_.empty() || !(memoryStep_ > S(0))) {
      return;
    }
    const S ratio = dt / memoryStep_;
    found_.assign(contacts_.size(), none);
    std::size_t m = 0;
    for (std::size_t k = 0; k < contacts_.size() && m < memory_.size(); ++k) {
      while (m < memory_.size() &&
             (memory_[m].key1 < contacts_[k].key1 ||
              (memory_[m].key1 == contacts_[k].key1 && memory_[m].key2 < contacts_[k].key2))) {
        ++m;
      }
      if (m < memory_.size() && memory_[m].key1 == contacts_[k].key1 &&
          memory_[m].key2 == contacts_[k].key2) {
        found_[k] = static_cast<std::uint32_t>(m);
      }
    }
    for (std::size_t k = coloring_.loneCount(); k < problem_.rows.size(); ++k) {
      detail::SolverRow<S>& row = problem_.rows[k];
      if (found_[row.contact] == none) {
        continue;
      }
      const ContactImpulse<S>& last = memory_[found_[row.contact]].impulse;
      row.jn = problem_.impulseIn(S(ratio * last.normal));
      if (problem_.friction && row.staticFriction > S(0)) {
        const Vector3<S> jt = problem_.impulseIn(Vector3<S>(ratio * last.tangential));
        row.jt = clampToCone<S>(Vector3<S>(jt - row.n.dot(jt) * row.n), row.jn, row.staticFriction,
                                row.kineticFriction);
      }
    }
  }

  void takeImpulses() {
    for (const detail::SolverRow<S>& row : problem_.rows) {
      impulses_[row.contact] = {problem_.impulseOut(row.jn), problem_.impulseOut(row.jt), row.impact};
    }
  }

  void remember(const S& dt) {
    memory_.clear();
    memoryStep_ = dt;
    if (settings_.warmStart) {
      for (std::size_t k = 0; k < contacts_.size(); ++k) {
        if (impulses_[k].normal > S(0)) {
          memory_.push_back({contacts_[k].key1, contacts_[k].key2, impulses_[k]});
        }
      }
    }
  }

  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

  std::variant<SequentialImpulses<S>> algorithm_;
  ContactSettings<S> settings_;
  ContactColoring coloring_;
  ContactProblem<S> problem_;
  ContactEnergy<S> energy_;
  PositionalCorrection<S> correction_;
  std::span<const Contact<S>> contacts_;
  std::vector<ContactImpulse<S>> impulses_;
  std::vector<StoredImpulse<S>> memory_;
  S memoryStep_ = S(0);
  std::vector<std::uint32_t> found_;
};

}  // namespace gravel
