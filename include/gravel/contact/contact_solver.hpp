#pragma once

/// \file
/// Solves the contacts of a step together: the run-time choice of an algorithm, with what all of them need,
/// colours, warm start, losses and correction of positions.

#include <gravel/contact/earlier_impulses.hpp>
#include <gravel/contact/positional_correction.hpp>
#include <gravel/contact/sequential_impulses.hpp>

#include <variant>

namespace gravel {

enum class ContactSolverKind { SequentialImpulses };

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
  /// What the last contacts are remembered by is handed on to those with the same keys. \param contacts
  /// sorted by keys; kept as a view, whose geometry may be renewed before solve(), after correctPositions()
  template <ContactBodies B>
  void begin(const ContactView<S>& contacts, const B& bodies) {
    begin(contacts, bodies, ContactFacts<S>::of(contacts, bodies, names_));
  }
  /// \param facts of these contacts, compared with names()
  template <ContactBodies B>
  void begin(const ContactView<S>& contacts, const B& bodies, const ContactFacts<S>& facts) {
    contacts_ = contacts;
    facts_ = facts;
    const bool solved = std::exchange(goesOn_, false) && inRows_ && problem_.rows.size() == names_.size();
    if (!std::exchange(fresh_, true) || names_.empty()) {  // else nothing was solved since they ended
      detail::clearSpare(ended_);
    }
    const bool asMany = contacts.size() == names_.size() && contacts.size() == coloring_.rows().size();
    // The same pairs of the same bodies: colours, and who is remembered, stay.
    if (!asMany || facts.others > 0 || !sameMovable(bodies)) {
      using Rows = std::span<const ContactColoring::Row>;
      before_.take(names_, inRows_ ? rowImpulses_ : restored_, inRows_ ? coloring_.rows() : Rows{});
      restored_ = {};
      if (solved) {
        before_.findEnded(contacts.contacts, problem_.rows, bodies, ended_);
      }
      coloring_.build(contacts.contacts, bodies);
      before_.handOn(contacts.contacts, coloring_.rows(), names_, rowImpulses_);
      handedOn_ = true;
      otherRows_ = true;
      listed_ = false;
      sameNames_ = false;
      inRows_ = true;
    }
  }

  /// The contacts of begin(), at the place where they stand now: after they, or what owns them, were copied.
  void rebind(const ContactView<S>& contacts) { contacts_ = contacts; }

  /// Changes the velocities (and, where there is friction, the spins) of the bodies so that every contact
  /// of begin() obeys restitution and Coulomb's law. A second call takes the contacts to be where they were.
  /// \param dt [s] >= 0, the step for which the contacts stand
  template <ContactBodies B>
  ContactReport<S> solve(B& bodies, const S& dt, const WayAhead<S>& way = {}) {
    detail::require("step of a contact solve", dt, detail::nonNegative<S>());
    const ContactView<S>& contacts = contacts_;
    ContactReport<S> report;
    const bool goesOn = std::exchange(goesOn_, false);
    listed_ = false;
    sameNames_ = !handedOn_;
    // What was handed on gives way to what is solved, row by row.
    const detail::ImpulseList<S>* last = &rowImpulses_;
    if (sameNames_) {
      std::swap(before_.impulses(), rowImpulses_);
      before_.forgetNames();
      last = &before_.impulses();
    }
    handedOn_ = false;
    kept_ = false;
    if (!contacts.empty()) {
      // Forces that last give impulses in proportion of the steps.
      const S ratio = settings_.warmStart && memoryStep_ > S(0) ? S(dt / memoryStep_) : S(0);
      rowImpulses_.resize(contacts.size(), facts_.kinds.turn);
      problem_.gather(contacts, bodies, coloring_, dt, settings_, facts_.kinds, rowImpulses_, *last, ratio,
                      fresh_, goesOn && ratio > S(0), way);
      fresh_ = false;
      if (problem_.active) {
        report = std::visit([&](auto& algorithm) { return algorithm.solve(problem_, coloring_, settings_); },
                            algorithm_);
        kept_ = problem_.kept;
        if (kept_) {
          problem_.keepLast(coloring_, before_.impulses());
        }
        energy_.book(problem_, coloring_, contacts, otherRows_, report);
        otherRows_ = false;
        problem_.scatter(bodies, coloring_);
        goesOn_ = true;
      }
      problem_.end();
    }
    if (!goesOn_) {
      rowImpulses_.clear(contacts.size());
    }
    report.contacts = contacts.size();
    report.colours = coloring_.colours() + (coloring_.loneCount() > 0 ? 1U : 0U);
    memoryStep_ = dt;
    return report;
  }

  /// begin() and solve() in one.
  template <ContactBodies B>
  ContactReport<S> solve(const ContactView<S>& contacts, B& bodies, const S& dt) {
    begin(contacts, bodies);
    return solve(bodies, dt);
  }

  /// Opens the overlaps of the contacts of begin() by moving bodies.
  template <ContactBodies B>
  CorrectionReport<S> correctPositions(B& bodies, const CorrectionSettings<S>& settings) {
    return correction_.apply(contacts_.contacts, coloring_, bodies, settings, facts_);
  }

  /// Whether the next solve() has an impulse of an earlier one to begin from.
  bool remembers() const { return rowImpulses_.any(); }

  /// The contacts of begin() by name; the view holds until the next one.
  std::span<const ContactName> names() const { return names_; }

  const std::vector<Displacement<S>>& displacements() const { return correction_.displacements(); }

  /// Contacts of begin(), which are the caller's, and the impulses [N s] of the last solve() in their order.
  /// O(contacts) once a solve; the view holds until the next one.
  const ContactView<S>& contacts() const { return contacts_; }
  std::span<const ContactImpulse<S>> impulses() {
    if (!listed_) {
      list_ = copyImpulses();
      listed_ = true;
    }
    return list_;
  }
  std::vector<ContactImpulse<S>> copyImpulses() const {
    return inRows_ ? inOrder(rowImpulses_) : restored_.listed([](std::size_t k) { return k; });
  }

  /// sum J.(dv_2 - dv_1) of the last solve(), along the normals and across [J]: what its impulses do to
  /// velocities that change by dv(body) [m s^-1]. O(contacts).
  template <class Change>
  Eigen::Array<S, 2, 1> workOn(Change&& dv) {
    using Sums = Eigen::Array<S, 2, 1>;
    std::vector<Vector3<S>> changes(coloring_.bodies().size() + 1);  // by slot
    changes.back() = Vector3<S>::Zero();
    parallelFor(coloring_.bodies().size(), chunk,
                [&](std::size_t slot) { changes[slot] = dv(coloring_.bodies()[slot]); });
    return detail::sumOverAllParts(
        coloring_, Sums(Sums::Zero()), [&](std::size_t begin, std::size_t end, Sums& sums) {
          for (std::size_t r = begin; r < end; ++r) {
            const ContactColoring::Row& place = coloring_.rows()[r];
            const Vector3<S> change = changes[place.slot2] - changes[place.slot1];
            // None between two that fall alike: their row is not fetched.
            const bool any = !detail::equalIsSame<S> || change != Vector3<S>::Zero();
            if (any && rowImpulses_.normal(r) > S(0)) {
              sums += Sums(rowImpulses_.normal(r) * problem_.rows[r].n.dot(change),
                           rowImpulses_.tangential(r).dot(change));
            }
          }
        });
  }
  const ContactColoring& coloring() const { return coloring_; }
  /// Whether restitution acted in row r of the last solve().
  bool isBlow(std::size_t r) const { return rowImpulses_.isImpact(r); }
  /// What the last solve() did to the velocity of a body [m s^-1], and to its spin [rad/s].
  Vector3<S> changeOf(std::uint32_t body) const {
    return goesOn_ ? problem_.changeOf(coloring_.slotOf(body)) : Vector3<S>(Vector3<S>::Zero());
  }
  Vector3<S> turnOf(std::uint32_t body) const {
    return goesOn_ ? problem_.turnOf(coloring_.slotOf(body)) : Vector3<S>(Vector3<S>::Zero());
  }

  /// Whether a body has contacts of begin().
  bool knows(std::uint32_t body) const { return coloring_.slotOf(body) != coloring_.staticSlot(); }
  /// Against what [m s^-2] these hold it, at the last solve(); 0 of what they do not move.
  const S& fallOf(std::uint32_t body) const { return problem_.fallOf(coloring_.slotOf(body)); }
  const S& mostFall() const { return problem_.mostFall(); }  ///< of all

  /// Those of the solve before the last begin() that it was not given any more, in the order of their keys.
  const std::vector<detail::EndedContact<S>>& ended() const { return ended_; }
  /// Of the solve before the last one, whose contacts may have been others, in the order of their keys.
  const ContactKeys& earlierKeys(std::size_t k) const {
    return sameNames_ ? names_[k].keys : before_.keys(k);
  }
  std::vector<ContactImpulse<S>> earlierImpulses() const {
    if (!sameNames_) {
      return before_.listed();
    }
    if (!kept_) {
      return inOrder(before_.impulses());
    }
    std::vector<ContactImpulse<S>> same = inOrder(rowImpulses_);
    for (std::size_t k = 0; k < coloring_.islandsEnd(); ++k) {
      same[coloring_.rows()[k].contact] = before_.impulses().get(k);
    }
    return same;
  }

  /// What the next solve() begins from: the impulses of the last one by keys, and its step [s]. A restart
  /// that puts them back continues with the same bits.
  std::vector<StoredImpulse<S>> memory() const {
    std::vector<StoredImpulse<S>> memory;
    const std::vector<ContactImpulse<S>> last = copyImpulses();
    for (std::size_t k = 0; k < names_.size() && settings_.warmStart; ++k) {
      if (last[k].normal > S(0)) {
        memory.push_back({names_[k].keys.first, names_[k].keys.second, last[k]});
      }
    }
    return memory;
  }
  const S& memoryStep() const { return memoryStep_; }
  /// What the next solve() goes on from, if it does so.
  auto solved() const { return goesOn_ ? problem_.solved(coloring_) : detail::SolvedProblem<S>{}; }
  /// So does the next one after a restart: begin() was given the contacts of that solve, where they stood.
  template <ContactBodies B>
  void resume(const detail::SolvedProblem<S>& solved, const B& bodies) {
    if (solved.bodies.size() == coloring_.bodies().size() && !solved.bodies.empty() &&
        (solved.rows.size() == coloring_.rows().size() || solved.rows.empty())) {
      problem_.resume(solved, bodies, coloring_, facts_.kinds);
      goesOn_ = true;
    }
  }
  /// \param memory sorted by keys
  void setMemory(const std::vector<StoredImpulse<S>>& memory, const S& step) {
    if (sameNames_) {
      before_.name(names_, coloring_.rows());
      sameNames_ = false;
    }
    names_.clear();
    names_.reserve(memory.size());
    restored_.resize(memory.size(), true);
    listed_ = false;
    for (const StoredImpulse<S>& stored : memory) {
      restored_.set(names_.size(), stored.impulse);
      names_.push_back({stored.keys(), staticPartner, staticPartner});
    }
    inRows_ = false;
    goesOn_ = false;
    memoryStep_ = step;
  }
  void forget() {
    goesOn_ = false;
    rowImpulses_.clear(rowImpulses_.size());
    restored_.clear(restored_.size());
    listed_ = false;
  }

 private:
  static constexpr std::size_t chunk = 512;

  template <class B>
  bool sameMovable(const B& bodies) const {
    for (std::uint32_t slot = 0; slot < coloring_.bodies().size(); ++slot) {
      if (coloring_.movable(slot) != detail::isMovable(bodies, coloring_.bodies()[slot])) {
        return false;
      }
    }
    return true;
  }

  /// From the order of rows to that of contacts.
  std::vector<ContactImpulse<S>> inOrder(const detail::ImpulseList<S>& ofRows) const {
    std::vector<std::uint32_t> rowOf;
    detail::findRows(coloring_.rows(), rowOf);
    return ofRows.listed([&](std::size_t k) { return rowOf[k]; });
  }

  std::variant<SequentialImpulses<S>> algorithm_;
  ContactSettings<S> settings_;
  ContactColoring coloring_;
  ContactFacts<S> facts_;  ///< of the contacts of begin()
  ContactProblem<S> problem_;
  ContactEnergy<S> energy_;
  PositionalCorrection<S> correction_;
  ContactView<S> contacts_;
  std::vector<ContactName> names_;      ///< of the contacts of begin(), or of the memory put back
  detail::ImpulseList<S> rowImpulses_;  ///< in the order of rows
  detail::ImpulseList<S> restored_;     ///< of a memory put back, in place of them
  bool inRows_ = true;
  std::vector<ContactImpulse<S>> list_;  ///< of impulses(), if `listed_`
  bool listed_ = false;
  std::vector<detail::EndedContact<S>> ended_;
  /// Of the solve before, whose contacts have other names unless `sameNames_`.
  detail::EarlierImpulses<S> before_;
  S memoryStep_ = S(0);
  bool handedOn_ = false;   ///< no solve() since
  bool kept_ = false;       ///< the last solve() left all large islands with the impulses of the one before
  bool goesOn_ = false;     ///< the last solve() was of these contacts, where they stand
  bool otherRows_ = true;   ///< than those that `energy_` knows
  bool sameNames_ = false;  ///< `before_` goes with `names_` and the present rows
  bool fresh_ = true;       ///< contacts may be elsewhere than at the last gathering
};

}  // namespace gravel
