#!/bin/sh
# Installs Debian's Chromium for the tests of the replay page and for films, where it is not there yet.
# Needs root (or sudo without a password) and apt-get; ends with 1 and says so where that cannot be done.
set -eu
if [ -n "${CAROM_CHROMIUM:-}" ] || [ -x /usr/bin/chromium ] || [ -x /usr/bin/chromium-browser ]; then
  exit 0
fi
as_root=
if [ "$(id -u)" -ne 0 ]; then
  if ! sudo -n true 2>/dev/null; then
    echo "install_chromium: no Chromium here, and no root to install it; ask for: apt-get install chromium" >&2
    exit 1
  fi
  as_root="sudo -n"
fi
if ! command -v apt-get >/dev/null; then
  echo "install_chromium: no Chromium and no apt-get here; install Chromium and name it in CAROM_CHROMIUM" >&2
  exit 1
fi
export DEBIAN_FRONTEND=noninteractive
$as_root apt-get -qq update >&2 && $as_root apt-get -qq install -y chromium >&2 || {
  echo "install_chromium: apt-get could not install chromium (no network?)" >&2
  exit 1
}
