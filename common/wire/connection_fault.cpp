#include "common/wire/connection_fault.hpp"

#include <openssl/ssl.h>
#include <openssl/x509_vfy.h>

#include <utility>
#include <vector>

#include "common/wire/certificate_files.hpp"
#include "common/wire/tls_probe.hpp"

namespace osteon::wire {
namespace {

using namespace std::chrono_literals;
using Reached = Probe::Reached;

constexpr auto kPatience = 3s;

ConnectionFault for_now(std::string sentence) { return {{ErrorCode::unavailable, std::move(sentence)}, false}; }
ConnectionFault lasting(ErrorCode code, std::string sentence) { return {{code, std::move(sentence)}, true}; }

std::string now_text() { return text_of(std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now())); }
std::string clock_text() { return "this machine's clock says " + now_text(); }

// What a TLS alert (RFC 8446, section 6.2) says about the certificate that we showed. X509_V_OK: nothing.
int fault_of_alert(int alert) {
  switch (alert) {
    case SSL_AD_CERTIFICATE_EXPIRED:
      return X509_V_ERR_CERT_HAS_EXPIRED;
    case SSL_AD_CERTIFICATE_REVOKED:
      return X509_V_ERR_CERT_REVOKED;
    case SSL_AD_UNKNOWN_CA:
      return X509_V_ERR_UNABLE_TO_GET_ISSUER_CERT;
    case SSL_AD_UNSUPPORTED_CERTIFICATE:
      return X509_V_ERR_INVALID_PURPOSE;
    case SSL_AD_BAD_CERTIFICATE:  // OpenSSL sends this also for a certificate that is not valid yet
    case SSL_AD_CERTIFICATE_UNKNOWN:
    case SSL_AD_ACCESS_DENIED:
      return X509_V_ERR_APPLICATION_VERIFICATION;
    default:
      return X509_V_OK;
  }
}

// Finds out why a connection failed.
class Diagnosis {
 public:
  Diagnosis(const std::string& address, const ClientCredentials& credentials, const std::function<bool()>& stop)
      : address_(address),
        host_(address.substr(0, address.rfind(':'))),
        folder_(credentials.certificates),
        stop_(stop) {
    if (host_.starts_with('[') && host_.ends_with(']')) host_ = host_.substr(1, host_.size() - 2);
  }

  ConnectionFault find() {
    if (!is_plain()) {
      const Result<ProbeFiles> read = read_certificate_files(folder_);
      if (!read) return {read.error(), true};
      files_ = *read;
    }
    probe_ = probe_tls(host_, address_.substr(address_.rfind(':') + 1), files_, kPatience, stop_);
    switch (probe_.reached) {
      case Reached::nothing:
        return for_now("the name " + host_ + " has no address here (" + probe_.system +
                       "); check its spelling in --server, or give an IP address");
      case Reached::name:
        return not_connected();
      case Reached::machine:
        return no_tls();
      case Reached::tls:
        return is_plain() ? tls_for_plain() : tls_failed();
      case Reached::server:
        return slow();
    }
    return slow();
  }

 private:
  [[nodiscard]] bool is_plain() const { return folder_.empty(); }

  [[nodiscard]] ConnectionFault not_connected() const {
    if (probe_.is_refused) {
      ConnectionFault refused = for_now("nothing listens at " + address_ +
                                        ", though a machine answers there; start osteon-server on it, or " +
                                        "give with --server the address that it printed");
      refused.refused = true;
      return refused;
    }
    if (probe_.is_silent)
      return for_now("no machine answers at " + address_ +
                     "; see whether it is on, whether a firewall lets that port " +
                     "through, and whether --server is right");
    return for_now("there is no way to " + address_ + " from this machine (" + probe_.system +
                   "); check the network, and the address in --server");
  }

  [[nodiscard]] ConnectionFault no_tls() const {
    const std::string& first = probe_.first_bytes;
    // The start of a SETTINGS frame, which an HTTP/2 server sends first: three bytes of length, then the type.
    constexpr char kSettings = 4;
    if (first.size() > 3 && first[0] == 0 && first[3] == kSettings) {
      if (is_plain()) return slow();
      return lasting(ErrorCode::invalid_input,
                     "the server at " + address_ + " uses plain text, but you gave a " +
                         "certificate; give --plain in place of --certificates and --ticket, " +
                         "or start the server with --certificates");
    }
    if (!first.empty()) return not_osteon();
    if (probe_.is_closed)
      return for_now("what listens at " + address_ +
                     " closes the connection without an answer; it is no Osteon server, or " +
                     "one that is full: see --most-connections of the server and the limits of a proxy");
    return for_now("what listens at " + address_ +
                   " accepts the connection and sends nothing; it is no Osteon server, or " +
                   "one that hangs: look at its log, or start it anew");
  }

  [[nodiscard]] ConnectionFault not_osteon() const {
    return lasting(ErrorCode::unsupported,
                   "what answers at " + address_ + " is no Osteon server, but another program (such " +
                       "as a web server); give with --server the port that osteon-server printed");
  }

  [[nodiscard]] ConnectionFault slow() const {
    return for_now("an Osteon server answers at " + address_ +
                   ", but too slowly; try again, and let the client wait longer for it");
  }

  [[nodiscard]] ConnectionFault tls_for_plain() const {
    return lasting(ErrorCode::invalid_input, "the server at " + address_ + " asks for a certificate, but you gave " +
                                                 "--plain; give --certificates DIR with --ticket FILE in its place");
  }

  [[nodiscard]] ConnectionFault tls_failed() const {
    if (probe_.verify_error != X509_V_OK) return server_fault();
    if (probe_.alert == SSL_AD_NO_APPLICATION_PROTOCOL) return not_osteon();
    if (probe_.alert >= 0) return fault_of_alert(probe_.alert) == X509_V_OK ? handshake_failed() : own_fault();
    if (!probe_.is_agreed) return handshake_failed();
    if (probe_.protocol != "h2") return not_osteon();
    return probe_.is_closed ? own_fault() : slow();
  }

  // A fault of the server's certificate.
  [[nodiscard]] ConnectionFault server_fault() const {
    const std::string authority = (folder_ / "ca.pem").string();
    const Validity valid = probe_.shown ? validity_of(*probe_.shown) : Validity{};
    const auto denied = [](std::string sentence) { return lasting(ErrorCode::denied, std::move(sentence)); };
    if (is_unknown_authority(probe_.verify_error))
      return denied(
          "the certificate of the server at " + address_ + " is not of the authority in " + authority +
          ": it is not your server, or ca.pem is of another; check --server, and ask whoever runs the server " +
          "for its ca.pem");
    if (probe_.verify_depth > 0 && probe_.verify_error == X509_V_ERR_CERT_HAS_EXPIRED)
      return denied("the authority in " + authority +
                    " has expired; whoever runs the server makes a new one, and new " + "certificates for all (" +
                    clock_text() + ")");
    switch (probe_.verify_error) {
      case X509_V_ERR_CERT_HAS_EXPIRED:
        return denied("the certificate of the server at " + address_ + " expired at " + text_of(valid.ends) +
                      "; whoever runs the server makes a new one with deploy/certs server (" + clock_text() + ")");
      case X509_V_ERR_CERT_NOT_YET_VALID:
        return denied("the certificate of the server at " + address_ + " holds only from " + text_of(valid.begins) +
                      " on; set the clocks of both machines (" + clock_text() + ")");
      case X509_V_ERR_HOSTNAME_MISMATCH:
      case X509_V_ERR_IP_ADDRESS_MISMATCH:
        return denied("the certificate of the server at " + address_ + " is for " + machines_of(*probe_.shown) +
                      " and not for " + host_ +
                      "; give such a name with --server, or whoever runs the server makes a " + "certificate for " +
                      host_ + " too, with deploy/certs server");
      default:
        return denied("the certificate of the server at " + address_ +
                      " cannot be accepted: " + X509_verify_cert_error_string(probe_.verify_error) +
                      "; whoever runs the server makes one with deploy/certs server");
    }
  }

  // A fault of our own certificate: by the TLS alert that arrived, or by the certificate itself if the server sent
  // none. Our server ends a refused handshake without an alert and writes the reason only to its log.
  [[nodiscard]] ConnectionFault own_fault() const {
    const std::vector<X509Ptr> chain = certificates_of(files_.certificate);
    int fault = fault_of_alert(probe_.alert);
    if (fault == X509_V_OK || fault == X509_V_ERR_APPLICATION_VERIFICATION)
      fault = verify_own(chain, certificates_of(files_.authority));
    const Validity valid = validity_of(*chain.front());
    const std::string own = "your certificate, " + (folder_ / "person.pem").string() + ", ";
    const auto denied = [](std::string sentence) { return lasting(ErrorCode::denied, std::move(sentence)); };
    if (is_unknown_authority(fault))
      return denied("the server at " + address_ + " does not know the authority of " + own +
                    "and accepts no such certificate; ask whoever runs the server for one of its authority");
    switch (fault) {
      case X509_V_ERR_CERT_HAS_EXPIRED:
        return denied(own + "has expired: it holds until " + text_of(valid.ends) +
                      "; ask whoever runs the server for a new one (" + clock_text() + ")");
      case X509_V_ERR_CERT_NOT_YET_VALID:
        return denied(own + "holds only from " + text_of(valid.begins) + " on; set the clocks of both machines (" +
                      clock_text() + ")");
      case X509_V_ERR_CERT_REVOKED:
        return denied(own + "was revoked; ask whoever runs the server for a new one");
      case X509_V_ERR_INVALID_PURPOSE:
        return denied(own + "is not for a person; whoever runs the server makes one with deploy/certs person");
      default:
        return for_now("the server at " + address_ + " refuses " + own +
                       "though it is in time and of the authority in ca.pem: it was revoked, or too many calls came " +
                       "from you; wait a minute, and then ask whoever runs the server, whose log says why");
    }
  }

  [[nodiscard]] ConnectionFault handshake_failed() const {
    const std::string why =
        probe_.alert >= 0 ? SSL_alert_desc_string_long(probe_.alert) : "it does not come to its end";
    return for_now("the TLS handshake with " + address_ + " fails (" + why + "); look at the server's log");
  }

  const std::string address_;
  std::string host_;
  const std::filesystem::path folder_;
  const std::function<bool()>& stop_;
  ProbeFiles files_;
  Probe probe_;
};

}  // namespace

ConnectionFault connection_fault(const std::string& address, const ClientCredentials& credentials,
                                 const std::function<bool()>& stop) {
  return Diagnosis(address, credentials, stop).find();
}

}  // namespace osteon::wire
