// Who is let in: looks at the certificate in the handshake, at certificate, ticket and the list of who was revoked at
// the beginning of every call, and at all of it again several times a second for as long as a stream is open. The one
// place where a connection or a call is refused for who makes it.
#pragma once
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <set>
#include <tuple>
#include <unordered_map>
#include <vector>

#include "common/access/access_list.hpp"
#include "common/access/role_table.hpp"
#include "common/access/ticket.hpp"
#include "common/core/id.hpp"
#include "server/audit/audit_record.hpp"
#include "server/net/call_rates.hpp"
#include "server/net/connections.hpp"
#include "server/net/peer_claims.hpp"
#include "server/net/person_certificate.hpp"
#include "server/net/refusals.hpp"

namespace grpc {
class ServerCredentials;
}

namespace osteon {

class AuditTrail;

// A person who was let in.
struct Caller {
  std::string user;  // of the certificate
  std::string serial, ticket_id;
  std::string ticket_room;           // of the ticket; kAnyRoom: of every room
  Role ticket_role = Role::none;     // of the ticket
  Role role = Role::none;            // what holds now
  UnixTime ends{};                   // of the ticket
  TicketCheckKey ticket_key{};       // that checks the ticket
  UnixTime certificate_ends{};
  std::string room{};                // that the call named or meant, where the role holds
  std::string address{};             // from where the call came, as address_of() has it
};

// Why somebody was not.
struct Refusal {
  std::string_view reason;    // a fixed word, for counting
  bool is_known = false;      // it is clear who it is, but that person may not do this
  std::string sentence;       // for the caller
  bool is_for_now = false;    // the same call may be made later
};

// What is looked at of a call.
struct CallClaims {
  PeerClaims peer{};          // of the connection
  std::string_view ticket{};  // metadata osteon-ticket; empty: none came
  std::string_view room{};    // metadata osteon-room-bin; empty: none came
  std::string_view method{};  // full name; empty: whatever it is
  std::string_view about{};   // room that the message names, where `room` and the ticket name none; empty: none
};

// A stream that is open. Its end is heard of, or it is told to end, whatever comes first.
class OpenStream {
 public:
  virtual ~OpenStream() = default;
  [[nodiscard]] virtual Role role() const = 0;  // what holds now
};

struct GateCounts {
  std::uint64_t admitted = 0, refused = 0, ended = 0, displaced = 0;  // calls, calls, streams, sessions
  std::size_t streams = 0;                                           // open now
};

// Any thread.
class Gate {
 public:
  static constexpr std::chrono::milliseconds kLookEvery{250};
  using Now = std::function<UnixTime()>;

  // `folder`: ca.pem, server.pem, server.key, tickets.pub; access.txt and crl.pem where somebody was revoked. All are
  // read again when they change. `counts` outlives it. Errors: not_found, invalid_input; the sentence
  // names the file.
  [[nodiscard]] static Result<std::unique_ptr<Gate>> open(const std::filesystem::path& folder, RefusalCounts& counts, Now now = {});
  ~Gate();
  Gate(const Gate&) = delete;
  Gate& operator=(const Gate&) = delete;

  // Which room a call is to that names none, with a ticket for every room; empty: there is no such. Before the first call.
  void set_only_room(std::function<std::string()> name) { only_room_ = std::move(name); }

  // Tickets that are good for longer, counted from now, are refused; zero: none is. Before the first call.
  void set_most_ticket_life(std::chrono::hours most) { most_ticket_life_ = most; }

  // Through which connections are closed whose certificate is revoked; they outlive the gate. Before the first call.
  void set_connections(Connections& connections) { connections_ = &connections; }

  // Takes down every refusal; it outlives the gate. Before the first call.
  void set_trail(AuditTrail& trail) { trail_ = &trail; }
  // What is known of who makes a call, whether they may or not. `room`: that the call or its ticket names.
  struct CallTrace {
    AuditIdentity who;
    std::string room;
  };
  [[nodiscard]] CallTrace trace_of(const CallClaims& call);

  // Mutual TLS, with this gate in every handshake. It outlives the server.
  [[nodiscard]] std::shared_ptr<grpc::ServerCredentials> credentials();

  // Of a connection: whether its certificates, the client's first, are of the authority and let somebody in. Counted
  // and logged.
  [[nodiscard]] std::optional<Refusal> judge_handshake(std::string_view chain_pem);
  [[nodiscard]] tl::expected<Caller, Refusal> judge(const CallClaims& call);
  // The same, counted, and logged once for each person and reason.
  [[nodiscard]] tl::expected<Caller, Refusal> admit(const CallClaims& call);
  // A call with which something is wrong before it can be judged: counted and logged likewise.
  void note_refused(std::string_view reason, std::string_view sentence, const CallClaims& call);
  // A person began more calls than they may: their connections are closed, and they come again kPause later.
  static constexpr std::chrono::seconds kPause{60};
  void note_flood(const PeerClaims& peer);

  // Who may be who in a room. `kind`: of client. Errors denied: the identity is another person's or of another role, or a newer
  // one of the same person took its place.
  [[nodiscard]] Result<void> check_resume(const Caller& caller, const std::string& room, int kind, AuthorId author) const;
  // From now on this identity is the caller's. An earlier one of the same person, room and kind is nobody's, and its streams end.
  // Who comes `again` is checked as above in one step with it, and changes nothing where that fails: a newer one may have come
  // since it was asked.
  enum class Coming { anew, again };
  Result<void> joined(const Caller& caller, const std::string& room, int kind, AuthorId author, Coming coming = Coming::anew);
  [[nodiscard]] Result<void> check_author(const Caller& caller, const std::string& room, AuthorId author) const;
  // A room that is closed: its identities mean nothing any more.
  void forget_room(const std::string& room);

  // Looks again who it is, and as whom (`author` null: as nobody), in one step with the beginning: whose right ends meanwhile
  // is refused here or hears of it. `end` is called once, on a thread of the gate's own, when the caller may have the stream no
  // more; not after the result has been destroyed, except while that happens.
  using End = std::function<void(const Refusal& why)>;
  using Entered = tl::expected<std::shared_ptr<OpenStream>, Refusal>;
  [[nodiscard]] Entered enter(const Caller& caller, const std::string& room, AuthorId author, std::string_view method, End end);
  // What a caller would be in another room than that of the call, if the ticket were for it.
  [[nodiscard]] Role role_in(const Caller& caller, const std::string& room) const;
  [[nodiscard]] GateCounts counts() const;
  void look();  // at all streams, now

 private:
  class Watched;
  Gate(std::filesystem::path folder, RefusalCounts& counts, Now now);
  // Reads ca.pem and crl.pem. True: they are other ones now. Under reading_.
  [[nodiscard]] Result<bool> read_authorities();
  // Reads tickets.pub. True: it has other keys now. Under reading_.
  [[nodiscard]] Result<bool> read_ticket_keys();
  // Closes the connections whose certificate is revoked, and those of which nobody knows for a while whose they are.
  void close_revoked();
  [[nodiscard]] std::optional<std::string> revoked(const std::string& serial, const std::string& user,
                                                   const std::string& ticket_id) const;  // under mutex_
  [[nodiscard]] bool is_paused(const std::string& user) const;                           // under mutex_
  // Under mutex_. What changes while somebody is in: revocations, ends and roles. Sets the role that holds.
  [[nodiscard]] std::optional<Refusal> judge_again(Caller& caller, const std::string& room, std::string_view method) const;
  [[nodiscard]] std::optional<Refusal> judge_author(const Caller& caller, const std::string& room, AuthorId author) const;
  [[nodiscard]] Result<void> check_resume_locked(const Caller& caller, const std::string& room, int kind, AuthorId author) const;
  [[nodiscard]] Result<PersonCertificate> certificate_of(std::string_view pem);  // under mutex_, as the next three
  [[nodiscard]] Result<void> check_shown(const PeerClaims& peer);
  struct CheckedTicket {
    Ticket ticket;
    TicketCheckKey key;
  };
  [[nodiscard]] Result<CheckedTicket> ticket_of(std::string_view text);
  void refresh();
  void run();
  void audit_refusal(std::string_view reason, const CallClaims& call);

  const std::filesystem::path folder_;
  RefusalCounts& refusals_;
  const Now now_;
  std::function<std::string()> only_room_;
  std::chrono::hours most_ticket_life_{0};
  Connections* connections_ = nullptr;  // null: of a gate without a server
  AuditTrail* trail_ = nullptr;         // null: nothing is taken down
  std::mutex reading_;         // taken before mutex_, never within it
  AccessFile access_;          // under reading_, as the next
  std::string access_fault_, authorities_fault_, keys_fault_;  // that was logged last
  mutable std::mutex mutex_;
  AccessList access_list_;
  std::vector<TicketCheckKey> ticket_keys_;
  std::shared_ptr<const Authorities> authorities_;  // shared with handshakes that are under way
  std::set<std::string> listed_serials_;            // on the revocation lists
  std::set<std::string> checked_;  // certificates in PEM that a proxy showed and these authorities signed
  std::map<std::string, std::chrono::steady_clock::time_point> paused_;  // until when, by user
  // When somebody was revoked, until all connections that were open then were looked at.
  std::optional<std::chrono::steady_clock::time_point> revoked_at_;
  std::unordered_map<std::string, PersonCertificate> certificates_;  // by PEM, of those seen lately
  CallRates rates_;
  std::unordered_map<std::string, CheckedTicket> tickets_;     // by text, of those seen lately
  using Seat = std::tuple<std::string, std::string, int>;      // room, user, kind
  std::map<Seat, AuthorId> seats_;
  struct Member {
    Seat seat;
    Role role = Role::none;  // that the room knows of, from when they joined
  };
  std::map<std::pair<std::string, AuthorId>, Member> authors_;
  std::list<std::weak_ptr<Watched>> streams_;
  GateCounts counts_;
  std::condition_variable wake_;
  bool end_ = false;
  std::thread thread_;
};

}  // namespace osteon
