// The people of a room, as its log entries describe them: what they may do, their restrictions and their annotations.
#pragma once
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "common/access/role.hpp"
#include "common/core/digest.hpp"
#include "common/field/restrictions.hpp"
#include "common/tools/annotation.hpp"
#include "server/room/log_entry.hpp"

namespace osteon {

inline constexpr std::size_t kMostWordsBytes = 1024;

// Not synchronised; it is a part of the Room.
class People {
 public:
  struct Supervised {
    Restrictions supervision;
    RoomSeq seq;  // sequence number of the entry that set it
    AuthorId by;  // the author who did
  };

  void join(AuthorId author, Role role, std::uint32_t person, bool hand) { members_[author] = {role, person, hand}; }
  void supervise(RoomSeq seq, AuthorId by, const SuperviseEntry& entry) {
    supervised_[entry.subject] = {entry.supervision, seq, by};
  }
  void draw(const AnnotationEntry& entry);

  [[nodiscard]] Role role(AuthorId author) const;
  [[nodiscard]] std::uint32_t person(AuthorId author) const;  // pseudonym, 0: unnamed
  // An author without a role may do whatever an author with any role may do. Either the room is older than roles, or
  // the server knows nobody by name.
  [[nodiscard]] bool supervises(AuthorId author) const;
  [[nodiscard]] bool only_own(AuthorId author) const { return role(author) == Role::trainee; }
  // Whether the author may undo everything that others did.
  [[nodiscard]] bool may_undo_all(AuthorId author) const;
  // Whether both are the same person, as far as the persons are known.
  [[nodiscard]] bool same_person(AuthorId a, AuthorId b) const {
    return a == b || (person(a) != 0 && person(a) == person(b));
  }
  // The person's surgeon author that joined last, present or not. Null: there is none, or the person is unknown (0).
  [[nodiscard]] AuthorId newest_hand(std::uint32_t person) const;
  // The restrictions of an author. The default if nobody has set any.
  [[nodiscard]] const Supervised& supervised(AuthorId author) const;
  // What the author must obey: its own restrictions, then those of its person's newest surgeon author. An author that
  // may supervise others has only its own.
  [[nodiscard]] std::array<const Restrictions*, 2> binding(AuthorId author) const;
  [[nodiscard]] const std::map<std::uint32_t, Annotation>& annotations() const { return annotations_; }
  [[nodiscard]] std::uint32_t last_annotation() const { return last_annotation_; }
  // The annotation that a new one of this kind replaces; 0: none.
  [[nodiscard]] std::uint32_t replaced_by(const Annotation& drawn) const;

  // Adds nothing if nobody has a role, was supervised or has drawn anything. So the hash of an older room, from before
  // there were people, stays as it was.
  void add_to(Hasher& hasher) const;

 private:
  struct Member {
    Role role = Role::none;
    std::uint32_t person = 0;
    bool hand = false;
  };
  std::map<AuthorId, Member> members_;
  std::map<AuthorId, Supervised> supervised_;
  std::map<std::uint32_t, Annotation> annotations_;
  std::uint32_t last_annotation_ = 0;
};

}  // namespace osteon
