#!/usr/bin/perl
# A controller in Perl: whoever comes near the end of its authority keeps to 12.5 m/s.
# perl slow_when_near.pl PORT [TOKEN]
use strict;
use warnings;
use IO::Socket::INET;
use JSON::PP;

my ($port, $token) = @ARGV;
my $json = JSON::PP->new->canonical;
my $link = IO::Socket::INET->new(PeerAddr => '127.0.0.1', PeerPort => $port)
    or die "no simulation listens at $port\n";
$link->autoflush(1);
print $link $json->encode({ kankaku => 1, token => $token // '' }), "\n";
my $hello = $json->decode(scalar <$link>);
die "$hello->{error}\n" if $hello->{error};
while (my $line = <$link>) {
    my $seen = $json->decode($line);
    last if $seen->{over};
    die "$seen->{error}\n" if $seen->{error};
    my @asked = map {
        my $near = $seen->{running}[$_] && $seen->{eoa_m}[$_] - $seen->{front_m}[$_] < 600;
        $near ? 12.5 : undef
    } 0 .. $#{ $seen->{front_m} };
    print $link $json->encode({ decision => $seen->{decision}, ceiling_mps => \@asked }), "\n";
}
