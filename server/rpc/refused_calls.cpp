#include "server/rpc/refused_calls.hpp"

#include <grpc/support/log.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/support/server_interceptor.h>

#include <algorithm>
#include <string>
#include <string_view>

#include "common/core/mutex.hpp"
#include "common/runtime/log.hpp"
#include "server/audit/audit_trail.hpp"
#include "server/auth/connections.hpp"
#include "server/auth/peer_claims.hpp"

namespace osteon {
namespace {

using grpc::StatusCode;
using grpc::experimental::InterceptionHookPoints;

// gRPC's log has one function for the whole process, which takes no object. So the watches are global.
Mutex watches_mutex{LockRank::handshakes};
std::vector<HandshakeWatch*> watches OSTEON_GUARDED_BY(watches_mutex);

// What OpenSSL reports for a failed handshake, and what it means here.
struct HandshakeFault {
  std::string_view openssl, kind, sentence;
};
constexpr HandshakeFault kHandshakeFaults[] = {
    {"http request", "plain text", "it speaks plain text; a client needs --certificates and --ticket"},
    {"wrong version number", "plain text", "it speaks plain text; a client needs --certificates and --ticket"},
    {"peer did not return a certificate", "no certificate",
     "it shows no certificate; make one with deploy/certs person NAME"},
    {"alert certificate expired", "refuses this server's certificate: expired",
     "for it this server's certificate has expired; make a new one with deploy/certs server NAME..."},
    {"alert unknown ca", "refuses this server's certificate: authority",
     "it does not know the authority of this server; give that person ca.pem of this server"},
    {"alert bad certificate", "refuses this server's certificate: name",
     "this server's certificate has another name than the client used, or is not valid yet; make one for all names "
     "with deploy/certs server NAME..."},
    {"alert unsupported certificate", "refuses this server's certificate: purpose",
     "it takes this server's certificate for one of another purpose; make one with deploy/certs server NAME..."},
};

void read_log_line(gpr_log_func_args* line) {
  if (line->message == nullptr) return;
  const std::string_view said(line->message);
  if (!said.starts_with("Handshake failed")) return;
  // Part of OpenSSL's "error:0A00009C:SSL routines::http request". It contains no text from the client.
  const std::size_t routine = said.rfind("::");
  std::string_view kind = routine == std::string_view::npos ? said : said.substr(routine + 2), sentence = said;
  for (const HandshakeFault& known : kHandshakeFaults)
    if (said.find(known.openssl) != std::string_view::npos) {
      kind = known.kind;
      sentence = known.sentence;
    }
  const MutexLock lock(watches_mutex);
  for (HandshakeWatch* watch : watches) watch->note("an unauthenticated client: " + std::string(kind), sentence);
}

std::string_view reason_of(StatusCode code) {
  switch (code) {
    case StatusCode::INVALID_ARGUMENT:
    case StatusCode::UNIMPLEMENTED:
      return "request";  // gRPC's own word for a single request that it cannot read
    case StatusCode::RESOURCE_EXHAUSTED:
      return "quota";
    case StatusCode::PERMISSION_DENIED:
    case StatusCode::UNAUTHENTICATED:
      return "denied";
    default:
      return {};
  }
}

class CallNotes final : public grpc::experimental::Interceptor {
 public:
  CallNotes(RefusalCounts& refusals, grpc::experimental::ServerRpcInfo& call) : refusals_(refusals), call_(call) {}
  void Intercept(grpc::experimental::InterceptorBatchMethods* methods) override {
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_SEND_STATUS)) {
      const grpc::Status status = methods->GetSendStatus();
      const auto* trailers = methods->GetSendTrailingMetadata();
      const bool noted = trailers != nullptr && trailers->contains(kRefusalTrailer);
      if (const std::string_view reason = reason_of(status.error_code()); !noted && !reason.empty())
        refusals_.note(reason, peer_claims(*call_.server_context()).address,
                       std::string(call_.method()) + ": " + status.error_message());
    }
    methods->Proceed();
  }

 private:
  RefusalCounts& refusals_;
  grpc::experimental::ServerRpcInfo& call_;
};

class CallNotesMaker final : public grpc::experimental::ServerInterceptorFactoryInterface {
 public:
  explicit CallNotesMaker(RefusalCounts& refusals) : refusals_(refusals) {}
  grpc::experimental::Interceptor* CreateServerInterceptor(grpc::experimental::ServerRpcInfo* call) override {
    if (std::string_view(call->method()) == "/osteon.v1.RoomService/Join") return nullptr;
    return new CallNotes(refusals_, *call);  // gRPC deletes it
  }

 private:
  RefusalCounts& refusals_;
};

}  // namespace

void log_failed_call(std::string_view why) {
  static Mutex mutex{LockRank::leaf};  // of `log`; clang checks no locals
  static RefusalLog log;
  {
    const MutexLock lock(mutex);
    if (!log.is_new("", why)) return;
  }
  log::warn("a call failed", {{"reason", why}});
}

HandshakeWatch::HandshakeWatch(RefusalCounts& refusals, Connections& connections)
    : refusals_(refusals), connections_(connections) {
  {
    const MutexLock lock(watches_mutex);
    watches.push_back(this);
  }
  gpr_set_log_function(read_log_line);
}

HandshakeWatch::~HandshakeWatch() {
  const MutexLock lock(watches_mutex);
  watches.erase(std::ranges::find(watches, this));
}

void HandshakeWatch::note(const std::string& who, std::string_view said) {
  const std::string from = some_addresses(connections_);
  refusals_.note("tls", who, said, from);
  if (trail_)
    trail_->record({.who = {.address = from}, .action = "handshake", .result = kRefused, .detail = "no certificate"});
}

std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>> refused_call_notes(
    RefusalCounts& refusals) {
  std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>> makers;
  makers.push_back(std::make_unique<CallNotesMaker>(refusals));
  return makers;
}

}  // namespace osteon
