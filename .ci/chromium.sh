# Sourced by what tries pages in a browser. `have_chromium PACKAGE...` puts the path of chromium into `browser`. Where it is missing, or node while nodejs is
# among the packages, it installs these where apt-get may do so; it fails where one is missing still.
have_chromium() {
  chromium_is_there "$@" && return
  if [ "$(id -u)" = 0 ] && command -v apt-get > /dev/null; then
    { apt-get update -qq && apt-get install -y -qq "$@"; } > /dev/null 2>&1 || true
  fi
  chromium_is_there "$@"
}
chromium_is_there() {
  browser=$(command -v chromium || command -v chromium-browser || command -v google-chrome || true)
  [ -n "$browser" ] || return 1
  case " $* " in *" nodejs "*) command -v node > /dev/null ;; esac
}
